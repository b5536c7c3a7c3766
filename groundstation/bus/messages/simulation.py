"""Messages of the simulator: ground truth, steering, timing."""

from groundstation.bus.messages.base import Message
from groundstation.vectors import Vector3


class TruthState(Message, frozen=True, kw_only=True):
    """Ground truth of one body in the simulator."""

    position_m: Vector3
    """Position [m; world]."""
    velocity_m_s: Vector3
    """Velocity [m/s; world]."""
    attitude_rad: Vector3
    """Roll, pitch, yaw [rad; FLU]."""
    on_ground: bool
    """Whether it touches the floor."""


class SimCommand(Message, frozen=True, kw_only=True):
    """Steering of a simulated target."""

    action: str
    """`drive`, `stop`, `path` (back to its path) or `place`."""
    speed_m_s: float = 0.0
    """`drive`: forward speed [m/s]."""
    turn_rate_rad_s: float = 0.0
    """`drive`: turn rate [rad/s], counter-clockwise."""
    position_m: Vector3 | None = None
    """`place`: where to [m; world]."""


class SimStatus(Message, frozen=True, kw_only=True):
    """How well the simulator keeps real time, counted from the first take-off on."""

    ticks: int
    """Ticks of the simulator."""
    overruns: int
    """Ticks that began more than 10 ms late."""
    pictures: int = 0
    """Pictures of all emulated cameras."""
    late_pictures: int = 0
    """Pictures that were not ready when they should have arrived."""
    airborne: tuple[str, ...] = ()
    """Drones in the air."""
