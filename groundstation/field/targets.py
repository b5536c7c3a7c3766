"""Targets and the markers that drones and targets carry."""

from typing import Literal

import msgspec

from groundstation.vectors import Vector3


def odometry_name(target: str) -> str:
    """Return the name on the bus of the driver of a target's odometry."""
    return f"{target}_odometry"


class Marker(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A flat marker: `code` and `square_mm` of a checkerboard, or `dictionary`, `id` and `size_mm` of a tag."""

    kind: Literal["checkerboard", "aruco"] = "checkerboard"
    code: int | None = None
    square_mm: float = 44.0
    dictionary: str | None = None
    id: int | None = None
    size_mm: float | None = None


class DroneMarker(Marker, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The marker on top of a drone; position_m: its centre [base]."""

    position_m: Vector3 = (0.0, 0.0, 0.08)


class TargetMarker(Marker, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The marker on top of a target, `height_m` above the floor."""

    height_m: float = 0.4


class TargetOdometry(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Source of a target's own odometry, and the deviation of its velocity."""

    source: str
    speed_std_m_s: float = 0.05
    delay_ms: float = 20.0
    silent_after_s: float = 1.0


class Target(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A ground robot that is tracked: its marker and its motion model."""

    marker: TargetMarker
    model: Literal["constant_velocity", "coordinated_turn", "manoeuvring"] = "constant_velocity"
    base: Literal["turtlebot_2", "person", "rc_car"] = "turtlebot_2"
    max_speed_m_s: float = 0.7
    max_acceleration_m_s2: float = 0.5
    max_turn_rate_deg_s: float = 180.0
    acceleration_std_m_s2: float = 1.2
    turn_rate_std_deg_s: float | None = None
    turn_rate_correlation_s: float | None = None
    straight_s: float | None = None
    turning_s: float | None = None
    heading: bool = False
    odometry: TargetOdometry | None = None


class SingleTarget(Target, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The one target."""

    name: str


class WeightedTarget(Target, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """One of several targets; weight: of its uncertainty in the planner's cost."""

    weight: float = 1.0
