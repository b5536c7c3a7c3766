"""Poses, twists and their covariances as ROS 2 wants them: (x, y, z, rotations about x, y, z), row by row."""

import math
from typing import Any

import numpy as np

from groundstation.bus.messages import EntityEstimate, Vector3
from groundstation.engineering_views.ros2.codec import Ros2Codec
from groundstation.time_units import NS_PER_S

# Nobody says how sure the missing axes are: as large as to say nothing.
_UNKNOWN = 1e6
_PLANAR = (0, 1)
_POSE = (0, 1, 2, 5)


def covariance_36(entity: EntityEstimate) -> "np.ndarray[Any, np.dtype[np.float64]]":
    """Return a 6 x 6 covariance, row by row, from that of (x, y) or (x, y, z, yaw)."""
    size = len(entity.mean)
    axes = _POSE[:size] if size >= 4 else _PLANAR
    full = np.diag([_UNKNOWN] * 6)
    known = np.asarray(entity.covariance).reshape(size, size)
    full[np.ix_(axes, axes)] = known[: len(axes), : len(axes)]
    return np.ascontiguousarray(full.reshape(36))


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

    def heading(self, yaw_rad: float) -> Any:
        """Return the quaternion of a heading."""
        return self.quaternion((math.cos(yaw_rad / 2), 0.0, 0.0, math.sin(yaw_rad / 2)))

    def pose(self, position_m: Vector3, yaw_rad: float) -> Any:
        """Return a pose from a position and a heading."""
        return self.make("geometry_msgs/msg/Pose", position=self.point(position_m), orientation=self.heading(yaw_rad))

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
