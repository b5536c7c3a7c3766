"""Poses, twists and their covariances in ROS 2's order: (x, y, z, rotations about x, y, z), row by row."""

import math
from typing import Any

from groundstation.bus.messages import EntityEstimate, Vector3
from groundstation.engineering_views.ros2.codec import Ros2Codec
from groundstation.geometry.angles import quaternion_from_euler
from groundstation.time_units import NS_PER_S

# Variance of axes without an estimate: so large that it carries no information.
_UNKNOWN = 1e6
_LEAST = 1e-6
_ALL_UNKNOWN = [_UNKNOWN if index % 7 == 0 else 0.0 for index in range(36)]
_POSE = (0, 1, 2, 5)
# By the size of a mean: indices of its covariance, row by row, in that of six axes.
_PLACES = {size: [6 * row + column for row in _POSE[:size] for column in _POSE[:size]] for size in (2, 4)}


def covariance_36(entity: EntityEstimate) -> list[float]:
    """Return a 6 x 6 covariance, row by row, from that of (x, y) or (x, y, z, yaw)."""
    full = _ALL_UNKNOWN.copy()
    for place, value in zip(_PLACES[len(entity.mean)], entity.covariance, strict=True):
        full[place] = value
    return full


def velocity_covariance_36(entity: EntityEstimate) -> list[float]:
    """Return the 6 x 6 covariance of a twist in the entity's own frame, row by row; what is not known is so large."""
    full, told = _ALL_UNKNOWN.copy(), entity.velocity_covariance or ()
    size = math.isqrt(len(told))
    for place, value in enumerate(told):
        row, column = divmod(place, size)
        # Zero means unknown to many readers.
        full[6 * row + column] = max(value, _LEAST) if row == column else value
    return full


def heading_xyzw(yaw_rad: float) -> tuple[float, float, float, float]:
    """Return the quaternion (x, y, z, w) of a heading."""
    return 0.0, 0.0, math.sin(yaw_rad / 2), math.cos(yaw_rad / 2)


def attitude_xyzw(attitude_rad: Vector3) -> tuple[float, float, float, float]:
    """Return the quaternion (x, y, z, w) of roll, pitch and yaw [rad; FLU]."""
    w, x, y, z = quaternion_from_euler(*attitude_rad)
    return x, y, z, w


def velocity_ahead(entity: EntityEstimate) -> Vector3:
    """Return an entity's velocity [m/s] along its own heading (x without one), to the left, and up."""
    vx, vy, *up = entity.velocity_m_s
    yaw_rad = entity.mean[3] if len(entity.mean) > 3 else 0.0
    c, s = math.cos(yaw_rad), math.sin(yaw_rad)
    return c * vx + s * vy, c * vy - s * vx, up[0] if up else 0.0


class Builder:
    """Makes the parts that many messages share; stamps are Unix nanoseconds."""

    def __init__(self, codec: Ros2Codec) -> None:
        self.make = codec.make

    def time(self, stamp_ns: int) -> Any:
        """Return a time stamp."""
        return self.make("builtin_interfaces/msg/Time", sec=stamp_ns // NS_PER_S, nanosec=stamp_ns % NS_PER_S)

    def header(self, stamp_ns: int, frame: str = "world") -> Any:
        """Return a header."""
        return self.make("std_msgs/msg/Header", stamp=self.time(stamp_ns), frame_id=frame)

    def vector(self, xyz: Vector3) -> Any:
        """Return a vector."""
        return self.make("geometry_msgs/msg/Vector3", x=float(xyz[0]), y=float(xyz[1]), z=float(xyz[2]))

    def point(self, xyz: Vector3) -> Any:
        """Return a point."""
        return self.make("geometry_msgs/msg/Point", x=float(xyz[0]), y=float(xyz[1]), z=float(xyz[2]))

    def quaternion(self, wxyz: tuple[float, float, float, float]) -> Any:
        """Return a quaternion from (w, x, y, z)."""
        w, x, y, z = map(float, wxyz)
        return self.make("geometry_msgs/msg/Quaternion", x=x, y=y, z=z, w=w)

    def pose(self, position_m: Vector3, yaw_rad: float) -> Any:
        """Return a pose from a position and a heading."""
        x, y, z, w = heading_xyzw(yaw_rad)
        turn = self.quaternion((w, x, y, z))
        return self.make("geometry_msgs/msg/Pose", position=self.point(position_m), orientation=turn)

    def twist(self, velocity_m_s: Vector3, yaw_rate_rad_s: float = 0.0) -> Any:
        """Return a twist."""
        return self.make(
            "geometry_msgs/msg/Twist", linear=self.vector(velocity_m_s), angular=self.vector((0.0, 0.0, yaw_rate_rad_s))
        )

    def transform(self, stamp_ns: int, frames: tuple[str, str], position_m: Vector3, rotation: Any) -> Any:
        """Return a transform between (parent, child)."""
        return self.make(
            "geometry_msgs/msg/TransformStamped",
            header=self.header(stamp_ns, frames[0]),
            child_frame_id=frames[1],
            transform=self.make("geometry_msgs/msg/Transform", translation=self.vector(position_m), rotation=rotation),
        )
