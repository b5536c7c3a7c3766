"""Simulator only: ground truth, steering, timing."""

from groundstation.bus.messages.base import Message, Vector3


class TruthState(Message, frozen=True, kw_only=True):
    """Ground truth of one body in the simulator: position, velocity [world], roll, pitch, yaw [FLU], and contact."""

    position_m: Vector3
    velocity_m_s: Vector3
    attitude_rad: Vector3
    on_ground: bool


class SimCommand(Message, frozen=True, kw_only=True):
    """Steering of a simulated body (the TurtleBot): forward speed and turn rate, or back to its path."""

    action: str
    speed_m_s: float = 0.0
    turn_rate_rad_s: float = 0.0
    position_m: Vector3 | None = None


class SimStatus(Message, frozen=True, kw_only=True):
    """How well the simulator keeps real time: ticks since something flew, late ones among them, and who is airborne.

    pictures: of all emulated cameras, since something flew; late_pictures: not ready when they should have arrived.
    """

    ticks: int
    overruns: int
    pictures: int = 0
    late_pictures: int = 0
    airborne: tuple[str, ...] = ()
