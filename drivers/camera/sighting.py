"""A result of the detector: an identified marker with its pose."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from drivers.camera.pose import PoseChoice


@dataclass(frozen=True, slots=True)
class Sighting:
    """An identified marker in one picture; corners (n, 2) [px]."""

    entity: str
    margin: float
    choice: PoseChoice
    corners: NDArray[np.float64]
