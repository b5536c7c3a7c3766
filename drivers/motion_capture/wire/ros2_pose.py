"""Poses of ROS 2 in CDR, and the keys under which rmw_zenoh publishes them.

WIRE (docs/reference/ros2.md 1): `<domain>/<topic>/<DDS type>/<type hash>`.
"""

from typing import NamedTuple

from drivers.rmw_zenoh.wire.cdr import CdrReader, CdrWriter, WireError

Vector3 = tuple[float, float, float]
Quaternion = tuple[float, float, float, float]
POSE_STAMPED = "geometry_msgs/msg/PoseStamped"
# DDS type -> texts before the pose: the frame, and of an Odometry that of the vehicle.
_TEXTS = {
    "geometry_msgs::msg::dds_::PoseStamped_": 1,
    "geometry_msgs::msg::dds_::PoseWithCovarianceStamped_": 1,
    "nav_msgs::msg::dds_::Odometry_": 2,
}


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


def decode_pose(dds_type: str, payload: bytes) -> StampedPose:
    """Return the pose in a message; raises WireError for another type, and if cut short."""
    if dds_type not in _TEXTS:
        raise WireError("type")
    reader = CdrReader(payload)
    stamp_ns, frame = reader.header()
    if _TEXTS[dds_type] == 2:
        reader.text()
    x, y, z, qx, qy, qz, qw = reader.numbers("d", 7)
    return StampedPose(stamp_ns, frame, ((x, y, z), (qx, qy, qz, qw)))


def encode_pose(stamp_ns: int, position: Vector3, quaternion: Quaternion) -> bytes:
    """Return a PoseStamped in the frame `world`: Unix time [ns], place [m], quaternion (x, y, z, w)."""
    return CdrWriter().header(stamp_ns, "world").numbers("d", *position, *quaternion).payload
