"""The readings that a vehicle of any kind reports at one tick, as a value."""

from dataclasses import dataclass
from typing import Any

from groundstation.vectors import Vector3


@dataclass(frozen=True, slots=True)
class Readings:
    """Readings in SI units and FLU, as `Onboard` and `InertialEstimate` have them.

    ticks: the vehicle's own clock. velocity [m/s]: in the frame of its reports.
    height, echo, rejected: of the ultrasound. status: its reported state, by its kind.
    """

    ticks: int
    velocity: Vector3
    roll: float
    pitch: float
    yaw: float
    gyros: Vector3
    accelerometers: Vector3
    battery: float
    height: float = 0.0
    echo: float = 0.0
    rejected: int = 0
    position: Vector3 = (0.0, 0.0, 0.0)
    status: tuple[Any, ...] = ()

    @property
    def vx(self) -> float:
        """Return the forward velocity [m/s]."""
        return self.velocity[0]

    @property
    def vy(self) -> float:
        """Return the velocity to the left [m/s]."""
        return self.velocity[1]

    @property
    def vz(self) -> float:
        """Return the climb rate [m/s]."""
        return self.velocity[2]
