"""Flight animations of an AR.Drone: attitude, climb and heading of each. Pure.

WIRE: numbers and default durations of the SDK 2.0.1 (docs/reference/ardrone.md 2.4). How far each goes is not
documented: the names say the angles, the rest is made up to look alike.
"""

import math
from enum import IntEnum

_DANCE_RAD, _DANCE_M_S = math.radians(20.0), 0.5


class Animation(IntEnum):
    """Animations, by their numbers in AT*ANIM and control:flight_anim."""

    PHI_M30 = 0
    PHI_30 = 1
    THETA_M30 = 2
    THETA_30 = 3
    THETA_20_YAW_200 = 4
    THETA_20_YAW_M200 = 5
    TURNAROUND = 6
    TURNAROUND_GODOWN = 7
    YAW_SHAKE = 8
    YAW_DANCE = 9
    PHI_DANCE = 10
    THETA_DANCE = 11
    VZ_DANCE = 12
    WAVE = 13
    PHI_THETA_MIXED = 14
    DOUBLE_PHI_THETA_MIXED = 15
    FLIP_AHEAD = 16
    FLIP_BEHIND = 17
    FLIP_LEFT = 18
    FLIP_RIGHT = 19


# Rotation of a flip about (roll, pitch): right side down and nose down are positive.
FLIPS: dict[Animation, tuple[float, float]] = {
    Animation.FLIP_AHEAD: (0.0, 1.0),
    Animation.FLIP_BEHIND: (0.0, -1.0),
    Animation.FLIP_LEFT: (-1.0, 0.0),
    Animation.FLIP_RIGHT: (1.0, 0.0),
}
# A flip: gain height, turn once about the axis with the thrust cut, fly on.
FLIP_KICK_S, FLIP_KICK_M_S2 = 0.38, 6.5
FLIP_TURN_S = 0.4


def default_duration_s(animation: Animation) -> float:
    """Return the default duration of an animation."""
    if animation < Animation.TURNAROUND:
        return 1.0
    return 2.0 if animation is Animation.YAW_SHAKE else 5.0


def motion_at(animation: Animation, elapsed_s: float) -> tuple[float, float, float, float]:
    """Return (roll, pitch, climb, yaw rate) at a time of an animation other than a flip [rad, m/s, rad/s; FLU]."""
    tilt, swing = math.radians(30.0), math.tau * elapsed_s
    match animation:
        case Animation.PHI_M30 | Animation.PHI_30:
            return (tilt if animation is Animation.PHI_30 else -tilt), 0.0, 0.0, 0.0
        case Animation.THETA_M30 | Animation.THETA_30:  # theta is positive nose up
            return 0.0, (-tilt if animation is Animation.THETA_30 else tilt), 0.0, 0.0
        case Animation.THETA_20_YAW_200 | Animation.THETA_20_YAW_M200:
            clockwise = 1.0 if animation is Animation.THETA_20_YAW_200 else -1.0
            return 0.0, -math.radians(20.0), 0.0, -clockwise * math.radians(200.0)
        case Animation.TURNAROUND:
            return 0.0, 0.0, 0.0, -math.radians(72.0)
        case Animation.TURNAROUND_GODOWN:
            return 0.0, 0.0, -0.2, -math.radians(72.0)
        case Animation.YAW_SHAKE:
            return 0.0, 0.0, 0.0, math.radians(60.0) * math.cos(2.0 * swing)
        case Animation.YAW_DANCE:
            return 0.0, 0.0, 0.0, math.radians(90.0) * math.cos(0.6 * swing)
        case Animation.PHI_DANCE:
            return _DANCE_RAD * math.cos(0.8 * swing), 0.0, 0.0, 0.0
        case Animation.THETA_DANCE:
            return 0.0, _DANCE_RAD * math.cos(0.8 * swing), 0.0, 0.0
        case Animation.VZ_DANCE:
            return 0.0, 0.0, _DANCE_M_S * math.cos(0.8 * swing), 0.0
        case Animation.WAVE:
            return _DANCE_RAD * math.cos(0.8 * swing), 0.0, 0.5 * _DANCE_M_S * math.cos(0.8 * swing), 0.0
        case _:
            pace = 0.8 if animation is Animation.PHI_THETA_MIXED else 1.6
            return _DANCE_RAD * math.cos(pace * swing), _DANCE_RAD * math.sin(pace * swing), 0.0, 0.0
