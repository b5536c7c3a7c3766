"""Sources of pictures: one file for each kind, all behind `frames.FrameSource`."""
