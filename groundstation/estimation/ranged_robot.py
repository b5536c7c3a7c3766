"""Constant data of a robot with a transponder."""

from dataclasses import dataclass

from groundstation.bus.messages import Vector3


@dataclass(frozen=True, slots=True)
class RangedRobot:
    """Data for joining by ranges: transponder [m; base], heading on the pad [rad] and its deviation.

    yaw_drift: of the vehicle's own heading [rad per root second]; pad_m: the pad's place [m; world]; pad_limit_m: a
    robot that ranges put farther off stands elsewhere.
    """

    transponder_m: Vector3
    pad_yaw_rad: float
    pad_yaw_std_rad: float
    yaw_drift: float
    pad_m: tuple[float, float]
    pad_limit_m: float
