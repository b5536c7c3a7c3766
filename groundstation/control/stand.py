"""A place where a robot is to be, and where it is to look."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Stand:
    """A place [m; world], a heading [rad; world] and how fast the heading itself turns [rad/s].

    turn_rad_s: how fast a robot turns to it at most; None: as who returns.
    """

    x: float
    y: float
    yaw: float
    yaw_rate: float = 0.0
    turn_rad_s: float | None = None
