"""Poses of ROS 2 in CDR, and the keys under which rmw_zenoh publishes them.

WIRE (docs/reference/ros2.md 1): `<domain>/<topic>/<DDS type>/<type hash>`.
"""

import math
from typing import NamedTuple

from drivers.rmw_zenoh.wire.cdr import CdrReader, CdrWriter, WireError

Vector3 = tuple[float, float, float]
Quaternion = tuple[float, float, float, float]
# Of x, y, z [m] and of the heading [rad]; 0: unknown.
Deviations = tuple[float, float, float, float]
UNKNOWN: Deviations = (0.0, 0.0, 0.0, 0.0)
POSE_STAMPED = "geometry_msgs/msg/PoseStamped"
# DDS type -> texts before the pose (the frame, of an Odometry that of the vehicle), whether a covariance is behind it.
_TYPES = {
    "geometry_msgs::msg::dds_::PoseStamped_": (1, False),
    "geometry_msgs::msg::dds_::PoseWithCovarianceStamped_": (1, True),
    "nav_msgs::msg::dds_::Odometry_": (2, True),
}
# Variances of x, y, z and of the turn about z in a covariance (6, 6), and their largest deviations that tell something.
_VARIANCES, _MOST = (0, 7, 14, 35), (1e3, 1e3, 1e3, math.pi)


def expression(domain: int, prefix: str) -> str:
    """Return the key expression of all topics `<prefix>/<body>/pose`."""
    return "/".join(part for part in (str(domain), prefix.strip("/"), "*", "pose", "*", "*") if part)


def body_of(key: str) -> tuple[str, str]:
    """Return body and DDS type of a key; raises WireError for any other key."""
    parts = key.split("/")
    if len(parts) < 5 or parts[-3] != "pose":
        raise WireError("key")
    return parts[-4], parts[-2]


class StampedPose(NamedTuple):
    """Position [m] and quaternion (x, y, z, w) in a frame, at a time of the publisher's clock [ns], 0 for none."""

    stamp_ns: int
    frame: str
    pose: tuple[Vector3, Quaternion]
    deviations: Deviations = UNKNOWN


def decode_pose(dds_type: str, payload: bytes) -> StampedPose:
    """Return the pose in a message; raises WireError for another type, and if cut short."""
    if dds_type not in _TYPES:
        raise WireError("type")
    texts, has_covariance = _TYPES[dds_type]
    reader = CdrReader(payload)
    stamp_ns, frame = reader.header()
    if texts == 2:
        reader.text()
    x, y, z, qx, qy, qz, qw = reader.numbers("d", 7)
    deviations = _deviations(reader.numbers("d", 36)) if has_covariance else UNKNOWN
    return StampedPose(stamp_ns, frame, ((x, y, z), (qx, qy, qz, qw)), deviations)


def _deviations(covariance: tuple[float, ...]) -> Deviations:
    # WIRE (docs/reference/ros2.md 1): nodes that know none leave zeros, or begin it with -1; NaN compares false.
    if not covariance[0] >= 0.0:
        return UNKNOWN
    variances = (covariance[at] for at in _VARIANCES)
    x, y, z, heading = (min(math.sqrt(v), most) if v > 0.0 else 0.0 for v, most in zip(variances, _MOST, strict=True))
    return x, y, z, heading


def encode_pose(stamp_ns: int, position: Vector3, quaternion: Quaternion) -> bytes:
    """Return a PoseStamped in the frame `world`: Unix time [ns], place [m], quaternion (x, y, z, w)."""
    return CdrWriter().header(stamp_ns, "world").numbers("d", *position, *quaternion).payload
