"""Whether an estimate still says where a target is. Pure."""

import math

from groundstation.bus.messages import EntityEstimate
from groundstation.geometry.ellipse import semi_axes_95


def ellipse_m(entity: EntityEstimate) -> tuple[float, float]:
    """Return the semi-axes of the 95 % ellipse of an entity's place on the floor [m]."""
    xx, xy, yy = (entity.covariance[index] for index in (0, 1, len(entity.mean) + 1))
    major, minor, _ = semi_axes_95(xx, xy, yy)
    return major, minor


def is_anywhere(entity: EntityEstimate, room_m: tuple[float, float]) -> bool:
    """Return whether a target may be anywhere in a room of that length and width [m].

    While nobody searches for a lost target, its estimate drives on: beyond the walls, with an ellipse larger than the
    room.
    """
    if entity.kind != "target":
        return False
    outside = any(abs(at) > side / 2 for at, side in zip(entity.mean, room_m, strict=False))
    return ellipse_m(entity)[0] > math.hypot(*room_m) / 2 or (outside and not entity.converged)
