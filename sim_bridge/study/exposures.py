"""Exposure times of a study's cameras: each at its own rate, their phases spread."""

from collections.abc import Sequence
from typing import Generic, Protocol, TypeVar

# Share of a period by which an exposure may seem not yet due, because times are rounded.
_ROUNDING = 1e-6


class Exposing(Protocol):
    """A camera with a constant time between two pictures."""

    period_s: float


Camera = TypeVar("Camera", bound=Exposing)


class Exposures(Generic[Camera]):
    """Exposure schedule of several cameras, with phases spread evenly; each first exposes a period after its phase."""

    def __init__(self, cameras: Sequence[Camera]) -> None:
        self._phased = [
            (camera, camera.period_s, camera.period_s * index / len(cameras)) for index, camera in enumerate(cameras)
        ]
        self._exposed = [0] * len(cameras)

    def due(self, now_s: float) -> list[Camera]:
        """Return the cameras that expose in the tick that ends now."""
        found = []
        for index, (camera, period_s, phase_s) in enumerate(self._phased):
            number = int((now_s - phase_s) / period_s + _ROUNDING)
            if number != self._exposed[index]:
                self._exposed[index] = number
                found.append(camera)
        return found
