"""A marker at a surveyed place: observed, but not part of the state."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from groundstation.arrays import Array
from groundstation.estimation.layout import EntityKind
from groundstation.estimation.model_kernels import MotionKernels
from groundstation.estimation.models.protocol import Vector3


@dataclass(frozen=True, slots=True)
class Landmark:
    """A marker or beacon at a surveyed place [m; world]."""

    kind: ClassVar[EntityKind] = EntityKind.LANDMARK
    labels: ClassVar[tuple[str, ...]] = ()
    kernels: ClassVar[MotionKernels] = MotionKernels()
    present: ClassVar[bool] = True
    admitted: ClassVar[bool] = True

    position_m: Vector3

    @property
    def place_m(self) -> Vector3:
        """Return its place."""
        return self.position_m

    def own(self) -> None:
        """Return None: there is no kernel."""

    def prior(self) -> Array:
        """Return nothing: there is no block."""
        return np.zeros((2, 0))
