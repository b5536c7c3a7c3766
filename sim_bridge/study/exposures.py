"""Exposure times of a study's cameras: each at its own rate, their phases spread."""

from collections.abc import Sequence
from typing import Generic, Protocol, TypeVar

from sim_bridge.world.world import TICK_S


class Exposing(Protocol):
    """A camera with a constant time between two pictures."""

    period_s: float


Camera = TypeVar("Camera", bound=Exposing)


class Exposures(Generic[Camera]):
    """Exposure schedule of several cameras, with phases spread evenly."""

    def __init__(self, cameras: Sequence[Camera]) -> None:
        self._phased = [
            (camera, camera.period_s, camera.period_s * index / len(cameras)) for index, camera in enumerate(cameras)
        ]

    def due(self, now_s: float) -> list[Camera]:
        """Return the cameras that expose in the tick that ends now."""
        before_s = now_s - TICK_S
        return [
            camera
            for camera, period_s, phase_s in self._phased
            if int((now_s - phase_s) / period_s) != int((before_s - phase_s) / period_s)
        ]
