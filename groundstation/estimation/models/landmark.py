"""What stands still at a known place: it can be observed, and is no part of the state."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from groundstation.estimation import slots as s
from groundstation.estimation.belief import Array
from groundstation.estimation.layout import EntityKind
from groundstation.estimation.models.protocol import Vector3


@dataclass(frozen=True, slots=True)
class Landmark:
    """A marker or beacon at a surveyed place [m; world]."""

    kind: ClassVar[EntityKind] = EntityKind.LANDMARK
    labels: ClassVar[tuple[str, ...]] = ()
    kernels: ClassVar[tuple[int, int]] = (0, 0)
    present: ClassVar[bool] = True
    admitted: ClassVar[bool] = True

    position_m: Vector3

    def row(self) -> Array:
        """Return the place in the columns that sensors read."""
        row = np.zeros(s.PARAMETER_COLUMNS)
        row[:3] = self.position_m
        return row

    def prior(self) -> Array:
        """Return nothing: there is no block."""
        return np.zeros((2, 0))
