"""The newest word of a MAVLink vehicle."""

from dataclasses import dataclass

from drivers.mavlink.convert import BaseAttitude
from drivers.mavlink.turning import turned_on
from groundstation.bus.messages import Vector3
from groundstation.time_units import NS_PER_MS

FRESH_NS = 300 * NS_PER_MS


@dataclass(frozen=True, slots=True)
class LatestTelemetry:
    """What was told last; times 0: never. moved_ns, attitude_ns are of the last velocity and attitude, asked_ns of the
    last question for our time."""

    heard_ns: int = 0
    moved_ns: int = 0
    heartbeat_ns: int = 0
    asked_ns: int = 0
    base_mode: int = 0
    custom_mode: int = 0
    status: int = 0
    landed: int = 0
    landed_ns: int = 0
    healthy: int = 0
    ekf: int = 0
    battery: float | None = None
    battery_ns: int = 0
    attitude: BaseAttitude | None = None
    attitude_ns: int = 0
    inertial: tuple[float, ...] = ()
    velocity_m_s: Vector3 = (0.0, 0.0, 0.0)
    position_m: Vector3 | None = None

    def tells_motion(self, now_ns: int) -> bool:
        """Return whether its velocity is younger than 0.3 s."""
        return now_ns - self.moved_ns < FRESH_NS

    def attitude_at(self, now_ns: int) -> BaseAttitude | None:
        """Return the attitude as it is by now; None: never told."""
        return None if self.attitude is None else turned_on(self.attitude, now_ns - self.attitude_ns)
