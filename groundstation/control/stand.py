"""A stand: a place and heading from which a robot looks for a target, or waits."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Stand:
    """A place [m; world], a heading [rad; world] and how fast the heading itself turns [rad/s].

    turn_rad_s: largest yaw rate with which a robot turns to it; None: that of a returning robot.
    """

    x: float
    y: float
    yaw: float
    yaw_rate: float = 0.0
    turn_rad_s: float | None = None
