"""Angles in (-pi, pi], counter-clockwise positive."""

import math


def wrap(angle_rad: float) -> float:
    """Return the same direction in (-pi, pi]."""
    wrapped = math.remainder(angle_rad, math.tau)
    return math.pi if wrapped == -math.pi else wrapped


def difference(to_rad: float, from_rad: float) -> float:
    """Return the signed shortest turn from one direction to another, in (-pi, pi]."""
    return wrap(to_rad - from_rad)


def quaternion_from_euler(roll_rad: float, pitch_rad: float, yaw_rad: float) -> tuple[float, float, float, float]:
    """Return wxyz of parent_from_body for intrinsic z-y-x angles."""
    cr, sr = math.cos(roll_rad / 2), math.sin(roll_rad / 2)
    cp, sp = math.cos(pitch_rad / 2), math.sin(pitch_rad / 2)
    cy, sy = math.cos(yaw_rad / 2), math.sin(yaw_rad / 2)
    return (
        cr * cp * cy + sr * sp * sy,
        sr * cp * cy - cr * sp * sy,
        cr * sp * cy + sr * cp * sy,
        cr * cp * sy - sr * sp * cy,
    )


def quaternion_product(
    a_from_b: tuple[float, float, float, float], b_from_c: tuple[float, float, float, float]
) -> tuple[float, float, float, float]:
    """Return wxyz of a_from_c."""
    w, x, y, z = a_from_b
    p, q, r, s = b_from_c
    return (
        w * p - x * q - y * r - z * s,
        w * q + x * p + y * s - z * r,
        w * r - x * s + y * p + z * q,
        w * s + x * r - y * q + z * p,
    )


def euler_from_quaternion(wxyz: tuple[float, float, float, float]) -> tuple[float, float, float]:
    """Return the intrinsic z-y-x angles roll, pitch, yaw [rad] of parent_from_body, a unit quaternion."""
    w, x, y, z = wxyz
    roll = math.atan2(2.0 * (w * x + y * z), 1.0 - 2.0 * (x * x + y * y))
    pitch = math.asin(max(-1.0, min(1.0, 2.0 * (w * y - z * x))))
    return roll, pitch, math.atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))
