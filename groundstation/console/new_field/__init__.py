"""The page of `groundstation new --page`: a form that draws the room while it is filled in."""
