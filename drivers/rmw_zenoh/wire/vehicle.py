"""The messages that fly a vehicle: Odometry and BatteryState in; Twist, Empty and Trigger out. SI units, FLU.

WIRE (docs/reference/ros2.md 4): types, fields and type hashes.
"""

import math
from dataclasses import dataclass, field

from drivers.rmw_zenoh.wire.cdr import CdrReader, CdrWriter, WireError

Vector3 = tuple[float, float, float]
Quaternion = tuple[float, float, float, float]

# The same in every distribution with type hashes; a test checks them with rosbags, which has no services.
HASHES = {
    "geometry_msgs/msg/Twist": "RIHS01_9c45bf16fe0983d80e3cfe750d6835843d265a9a6c46bd2e609fcddde6fb8d2a",
    "geometry_msgs/msg/TwistStamped": "RIHS01_5f0fcd4f81d5d06ad9b4c4c63e3ea51b82d6ae4d0558f1d475229b1121db6f64",
    "std_msgs/msg/Empty": "RIHS01_20b625256f32d5dbc0d04fee44f43c41e51c70d3502f84b4a08e7a9c26a96312",
    "std_srvs/srv/Trigger": "RIHS01_eeff2cd6fa5ad9d27cdf4dec64818317839b62f212a91e6b5304b634b2062c5f",
}
ODOMETRY, BATTERY = "nav_msgs/msg/Odometry", "sensor_msgs/msg/BatteryState"
TWIST, TWIST_STAMPED, EMPTY, TRIGGER = HASHES
# A structure without fields has one byte in CDR: so has the request of a Trigger.
NOTHING = CdrWriter().numbers("B", 0).payload
_COVARIANCE = 36
_QUATERNION_ERROR = 0.1
# No vehicle is this high [m], moves or turns this fast [m/s, rad/s]; a larger finite number can overflow.
_ABSURD_M, _ABSURD_PER_S = 1e4, 1e3
_CHARGE_AT = 6  # voltage, temperature, current, charge, capacity, design capacity stand before it


@dataclass(frozen=True, slots=True)
class OdometryMessage:
    """The content of an Odometry.

    stamp_ns: on the sender's clock; position [m], quaternion (x, y, z, w) in its frame; velocity [m/s] and turn [rad/s]
    in the vehicle's own; frames: the names of both.
    """

    stamp_ns: int
    position: Vector3
    quaternion: Quaternion
    velocity: Vector3
    turn: Vector3
    frames: tuple[str, str] = field(default=("", ""), compare=False)


def decode_odometry(payload: bytes) -> OdometryMessage:
    """Return an Odometry; raises WireError for invalid bytes, and for values that are no motion of a vehicle.

    Such values are NaN, invalid rotations, absurd heights and velocities, and a twist in the axes of the room, shown by
    equal names of both frames.
    """
    reader = CdrReader(payload)
    stamp_ns, frame = reader.header()
    own_frame = reader.text()
    if own_frame == frame != "":
        raise WireError("twist in the axes of the room")
    x, y, z, qx, qy, qz, qw = reader.numbers("d", 7)
    reader.numbers("d", _COVARIANCE)
    values = reader.numbers("d", 6)
    if not all(map(math.isfinite, (x, y, z, qx, qy, qz, qw, *values))):
        raise WireError("no number")
    if abs(z) > _ABSURD_M or max(map(abs, values)) > _ABSURD_PER_S:
        raise WireError("absurd")
    size = math.hypot(qx, qy, qz, qw)
    if abs(size - 1.0) > _QUATERNION_ERROR:
        raise WireError("no rotation")
    turned = (qx / size, qy / size, qz / size, qw / size)
    return OdometryMessage(stamp_ns, (x, y, z), turned, values[:3], values[3:], (frame, own_frame))


def encode_odometry(message: OdometryMessage, frame: str, vehicle_frame: str) -> bytes:
    """Return the bytes of an Odometry; its covariances are 0, which means unknown."""
    unknown = (0.0,) * _COVARIANCE
    writer = CdrWriter().header(message.stamp_ns, frame).text(vehicle_frame)
    writer.numbers("d", *message.position, *message.quaternion, *unknown)
    return writer.numbers("d", *message.velocity, *message.turn, *unknown).payload


def decode_charge(payload: bytes) -> float:
    """Return the `percentage` of a BatteryState, a share [0..1]; raises WireError, also for one that is unknown."""
    reader = CdrReader(payload)
    reader.header()
    share = float(reader.numbers("f", _CHARGE_AT + 1)[_CHARGE_AT])
    if not 0.0 <= share <= 1.0:
        raise WireError("no charge")
    return share


def encode_battery(stamp_ns: int, share: float) -> bytes:
    """Return the bytes of a BatteryState with a charge and nothing else."""
    unknown = math.nan
    writer = CdrWriter().header(stamp_ns, "").numbers("f", 11.1, *(unknown,) * 5, share)
    return writer.numbers("B", 2, 1, 3, 1).blob(b"").blob(b"").text("").text("").payload


def encode_twist(velocity: Vector3, turn_rad_s: float, stamp_ns: int | None = None) -> bytes:
    """Return the bytes of a Twist, or with a Unix time [ns] of a TwistStamped in the vehicle's frame."""
    writer = CdrWriter() if stamp_ns is None else CdrWriter().header(stamp_ns, "base_link")
    return writer.numbers("d", *velocity, 0.0, 0.0, turn_rad_s).payload


def decode_twist(payload: bytes, stamped: bool) -> tuple[Vector3, float]:
    """Return velocity [m/s] and turn [rad/s] of a Twist or TwistStamped; raises WireError."""
    reader = CdrReader(payload)
    if stamped:
        reader.header()
    x, y, z, _, _, turn = reader.numbers("d", 6)
    if not all(map(math.isfinite, (x, y, z, turn))):
        raise WireError("no number")
    return (x, y, z), turn


def decode_answer(payload: bytes) -> tuple[bool, str]:
    """Return whether a Trigger succeeded, and its message; raises WireError."""
    reader = CdrReader(payload)
    return bool(reader.numbers("B")[0]), reader.text()


def encode_answer(success: bool, message: str) -> bytes:
    """Return the answer of a Trigger."""
    return CdrWriter().numbers("B", success).text(message).payload
