"""Rigid transforms `a_from_b`."""

from dataclasses import dataclass

import numpy as np

from groundstation.arrays import Array


@dataclass(frozen=True, slots=True)
class Pose:
    """Transform a_from_b: rotation (3, 3) and translation (3) [m]; finite, read-only."""

    rotation: Array
    translation: Array

    def __post_init__(self) -> None:
        for name, shape in (("rotation", (3, 3)), ("translation", (3,))):
            value = np.array(getattr(self, name), dtype=np.float64)
            if value.shape != shape or not np.isfinite(value).all():
                raise ValueError(f"{name} must be finite with shape {shape}")
            value.setflags(write=False)
            object.__setattr__(self, name, value)

    def apply(self, points_b: Array) -> Array:
        """Return points (..., 3) of frame b in frame a."""
        return points_b @ self.rotation.T + self.translation

    def compose(self, b_from_c: "Pose") -> "Pose":
        """Return a_from_c."""
        return Pose(self.rotation @ b_from_c.rotation, self.rotation @ b_from_c.translation + self.translation)

    def inverse(self) -> "Pose":
        """Return b_from_a."""
        return Pose(self.rotation.T, -self.rotation.T @ self.translation)
