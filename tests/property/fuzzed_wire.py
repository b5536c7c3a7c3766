"""Damaged packets, commands, video and frames of vehicles, and the decoders that read them."""

import struct
from contextlib import suppress

from damage import Random, damaged_bytes
from pymavlink.dialects.v20 import all as widest

from drivers.ardrone.wire import at, navdata, options, pave
from drivers.ardrone.wire.navdata import Navdata
from drivers.ardrone.wire.tags import OPTION_SIZES
from drivers.mavlink.convert import attitude_from_quaternion, imu_from_highres, velocity_from_local
from drivers.mavlink.links.stream_cutter import StreamCutter
from drivers.mavlink.wire import errors as mavlink_errors
from drivers.mavlink.wire import flight, service, telemetry
from drivers.mavlink.wire.frames import FrameDecoder, FrameEncoder, split
from drivers.mavlink.wire.signature import SIGNED, digest
from drivers.mavlink.wire.verification import Signing
from drivers.rmw_zenoh.wire import pictures, vehicle
from drivers.rmw_zenoh.wire.cdr import CdrWriter

# AR.Drone


def full_packet(profile: str) -> bytes:
    """Return navdata with every option of a firmware's packets."""
    typed = {int(layout.tag): layout for layout in options.LAYOUTS if layout.start == 4}
    values = {0: options.Demo(), 1: options.Time(), 3: options.PhysMeasures(), 10: options.Altitude()}
    payloads = [
        (tag, typed[tag].encode(values[tag], size) if tag in values else bytes(size - 4))
        for tag, size in OPTION_SIZES[profile].items()
    ]
    return navdata.encode(Navdata(0x0F800000, 9, 0, tuple(payloads)))


PACKETS = [full_packet(profile) for profile in OPTION_SIZES]


def damaged_navdata(rng: Random) -> tuple[bytes, bool]:
    data = damaged_bytes(rng, rng.choice(PACKETS))
    if rng.random() < 0.5 and len(data) > 24:
        data[-4:] = navdata.checksum(bytes(data[:-8])).to_bytes(4, "little")
    return bytes(data), rng.random() < 0.5


def read_navdata(damaged: tuple[bytes, bool]) -> None:
    packet = navdata.decode(*damaged)
    for layout in options.LAYOUTS:
        packet.read(layout)


COMMANDS = at.encode_datagram(
    [
        at.ref(True),
        at.pcmd(at.ProgressiveMotion(1, 0.1, -0.2, 0.3, 0.4)),
        at.config("control:outdoor", "TRUE"),
        at.ctrl(5),
    ],
    9,
)


def read_commands(damaged: bytearray) -> None:
    for command in at.decode_datagram(bytes(damaged)):
        at.decode_motion(command) if command.name == "PCMD" else command.text(0)


_HEAD = struct.pack("<4sBBHIHHHHIIBBBB", b"PaVE", 2, 4, 64, 90, 640, 368, 640, 360, 1, 2, 1, 0, 3, 0)
STREAM = (_HEAD.ljust(64, b"\0") + bytes(90)) * 4


def damaged_stream(rng: Random) -> list[bytes]:
    data, pieces = bytes(damaged_bytes(rng, STREAM, b"PaVE")), []
    while data:
        size = rng.randrange(1, 700)
        pieces.append(data[:size])
        data = data[size:]
    return pieces


def read_stream(pieces: list[bytes]) -> None:
    reader, count = pave.FrameReader(), sum(map(len, pieces))
    taken = sum(len(frame.payload) for piece in pieces for frame in reader.feed(piece))
    assert taken + reader.skipped <= count


# MAVLink

KEY = bytes(range(32))
MESSAGES = (
    telemetry.Heartbeat(2, 12, 129, 6 << 16, 4),
    telemetry.LocalPositionNed(1, 1.0, 2.0, 3.0, 0.1, 0.2, 0.3),
    telemetry.AttitudeQuaternion(1, 1.0, 0.0, 0.0, 0.0, 0.1, 0.2, 0.3),
    telemetry.HighresImu(1, 0.0, 0.0, -9.8, 0.1, 0.2, 0.3),
    telemetry.RawImu(1, 0, 0, -1000, 1, 2, 3),
    telemetry.SysStatus(7, 7, 7, battery_remaining=80),
    telemetry.Statustext(4, "PreArm: something is wrong"),
    telemetry.BatteryStatus(0, 0, 3, 300, (4000,) * 10, 5, 5, 5, 90),
    service.ParamValue("GUID_TIMEOUT", 0.5, 9, 30, 2),
    service.Timesync(0, 99),
    flight.CommandAckMessage(400, 0),
    flight.SetPositionTargetLocalNed(1, 1, 1, 8, 1479, *(0.5,) * 11),
    flight.CommandLong(1, 1, 400, 0, 1.0),
    flight.OdometryMessage(1, 1, 12, 0, 0, 0, (1, 0, 0, 0), 0, 0, 0, 0, 0, 0, (0.0,) * 21, (0.0,) * 21),
)
FRAMES_2 = [FrameEncoder(1, 1).encode(message) for message in MESSAGES]
FRAMES_1 = [
    FrameEncoder(1, 1).encode(message, old=True)
    for message in MESSAGES
    if not isinstance(message, flight.OdometryMessage)
]
SIGNED_FRAMES = [FrameEncoder(1, 1, Signing(KEY, 1000)).encode(message) for message in MESSAGES]


def damaged_frame(rng: Random) -> tuple[bytes, bool]:
    """Return a frame and whether it is signed; half of them have a corrected checksum and signature."""
    signed = rng.random() < 0.3
    data = damaged_bytes(rng, rng.choice(SIGNED_FRAMES if signed else FRAMES_2), b"\xfd\xfe\x01")
    tail = 13 if signed else 0
    if rng.random() < 0.5 and len(data) >= 12 + tail and data[0] == 0xFD and len(data) - 12 - tail < 256:
        data[1], data[2] = len(data) - 12 - tail, SIGNED if signed else 0
        kind = widest.mavlink_map.get(int.from_bytes(data[7:10], "little"))
        end = 10 + data[1]
        crc = widest.x25crc(bytes(data[1:end]) + bytes([kind.crc_extra if kind else 0])).crc
        data[end : end + 2] = crc.to_bytes(2, "little")
        if signed:
            data[-6:] = digest(KEY, bytes(data[:-6]))
    return bytes(data), signed


def damaged_old_frame(rng: Random) -> tuple[bytes, bool]:
    data = damaged_bytes(rng, rng.choice(FRAMES_1), b"\xfd\xfe")
    return bytes(data) + (rng.choice(FRAMES_2) if rng.random() < 0.1 else b""), False


def read_frames(damaged: tuple[bytes, bool]) -> None:
    data, signed = damaged
    decoder = FrameDecoder(Signing(KEY, 0) if signed else None)
    for raw in StreamCutter().feed(data):
        with suppress(mavlink_errors.WireError):
            decoder.decode(raw)
    decoder = FrameDecoder(Signing(KEY, 0) if signed else None)
    for raw in split(data):
        use(decoder.decode(raw).message)


def use(message: object) -> None:
    match message:
        case telemetry.LocalPositionNed():
            velocity_from_local(message, attitude_from_quaternion(MESSAGES[2]))
        case telemetry.AttitudeQuaternion():
            attitude_from_quaternion(message)
        case telemetry.HighresImu():
            imu_from_highres(message)


# ROS 2

_STILL = vehicle.OdometryMessage(9, (0.0, 0.0, 1.0), (0.0, 0.0, 0.0, 1.0), (0.1, 0.0, 0.0), (0.0, 0.0, 0.0))
_RAW = CdrWriter().header(9, "").numbers("I", 2, 3).text("mono8").numbers("B", 0).numbers("I", 3).blob(bytes(6)).payload
ROS2 = (
    (vehicle.encode_odometry(_STILL, "odom", "base_link"), vehicle.decode_odometry),
    (vehicle.encode_battery(9, 0.5), vehicle.decode_charge),
    (vehicle.encode_answer(False, "no GPS"), vehicle.decode_answer),
    (CdrWriter().header(9, "").text("jpeg").blob(b"\xff\xd8\xff\xd9").payload, pictures.decode_compressed),
    (_RAW, pictures.decode_raw),
    (vehicle.encode_twist((0.1, 0.2, 0.3), 0.4, 9), lambda payload: vehicle.decode_twist(payload, True)),
)


def damaged_ros2(rng: Random) -> tuple[int, bytes]:
    which = rng.randrange(len(ROS2))
    return which, bytes(damaged_bytes(rng, ROS2[which][0]))


def read_ros2(damaged: tuple[int, bytes]) -> None:
    ROS2[damaged[0]][1](damaged[1])
