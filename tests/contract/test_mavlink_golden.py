"""MAVLink 2 frames assembled by hand from the protocol's description decide, not our own encoder.

Layout: FD len incompat compat seq sys comp id(3) payload crc(2); the CRC is X.25 over all but the first byte, plus the
message's CRC_EXTRA; payload fields are ordered by size, trailing zeros are cut off.
"""

import hashlib
import struct

import pytest
from pymavlink.dialects.v20 import ardupilotmega as dialect

from drivers.mavlink.wire import flight, service, telemetry
from drivers.mavlink.wire.errors import WireError
from drivers.mavlink.wire.frames import FrameDecoder, FrameEncoder, dialect_faults, split
from drivers.mavlink.wire.names import Flavour
from drivers.mavlink.wire.parameters import INT32, REAL32, carried_from_value, value_from_carried
from drivers.mavlink.wire.verification import Signing

KEY = bytes(range(32))


def crc(data: bytes) -> int:
    """Return the X.25 CRC, written from its definition."""
    value = 0xFFFF
    for byte in data:
        value ^= byte
        for _ in range(8):
            value = value >> 1 ^ (0x8408 if value & 1 else 0)
    return value


def frame(number, payload, extra, seq=0, system=1, component=1, flags=0):
    payload = payload.rstrip(b"\0") or payload[:1]
    head = struct.pack("<BBBBBB", len(payload), flags, 0, seq, system, component) + number.to_bytes(3, "little")
    return b"\xfd" + head + payload + struct.pack("<H", crc(head + payload + bytes([extra])))


def signed(number, payload, extra, stamp, key=KEY, link=1):
    body = frame(number, payload, extra, flags=1)
    body += bytes([link]) + stamp.to_bytes(6, "little")
    return body + hashlib.sha256(key + body).digest()[:6]


# CRC_EXTRA of each message as in the MAVLink definitions.
CASES = [
    (
        telemetry.Heartbeat(2, 12, 129, 6 << 16, 4),
        frame(0, struct.pack("<IBBBBB", 6 << 16, 2, 12, 129, 4, 3), 50),
    ),
    (
        flight.SetPositionTargetLocalNed(7, 11, 1, 8, 1479, 0, 0, 0, 0.5, -0.25, -0.125, 0, 0, 0, 0, 0.75),
        frame(84, struct.pack("<I11fHBBB", 7, 0, 0, 0, 0.5, -0.25, -0.125, 0, 0, 0, 0, 0.75, 1479, 11, 1, 8), 143),
    ),
    (
        flight.CommandLong(11, 1, 400, 0, 0.0, 21196.0),
        frame(76, struct.pack("<7fHBBB", 0, 21196, 0, 0, 0, 0, 0, 400, 11, 1, 0), 152),
    ),
    (
        telemetry.LocalPositionNed(99, 1.0, -2.0, -0.5, 0.25, 0.5, -1.0),
        frame(32, struct.pack("<I6f", 99, 1, -2, -0.5, 0.25, 0.5, -1), 185),
    ),
    (service.PlayTune(11, 1, "L8CEG", ""), frame(258, struct.pack("<BB5s", 11, 1, b"L8CEG"), 187)),
    (service.Timesync(0, 2**40 + 5), frame(111, struct.pack("<qq", 0, 2**40 + 5), 34)),
    (
        service.ParamSet(11, 1, "GUID_TIMEOUT", 0.5, 9),
        frame(23, struct.pack("<fBB16sB", 0.5, 11, 1, b"GUID_TIMEOUT", 9), 168),
    ),
    (
        service.SetGpsGlobalOrigin(11, 473977420, 85455940, 488000),
        frame(48, struct.pack("<iiiBQ", 473977420, 85455940, 488000, 11, 0), 41),
    ),
    (
        flight.VisionPositionEstimate(1_000_000, 1.5, -2.5, -0.75, 0.125, -0.25, 0.5, (0.25, *(0.0,) * 19, 0.5), 3),
        frame(
            102, struct.pack("<Q6f21fB", 1_000_000, 1.5, -2.5, -0.75, 0.125, -0.25, 0.5, 0.25, *[0] * 19, 0.5, 3), 158
        ),
    ),
    (
        flight.OdometryMessage(
            5, 1, 12, 1, 2, -3, (1, 0, 0, 0), 0.5, 0, 0, 0, 0, 0.25, (0.5, *(0.0,) * 20), (2.0, *(0.0,) * 20), 4, 2, 100
        ),
        frame(
            331,
            struct.pack(
                "<Q3f4f3f3f21f21fBBBBb", 5, 1, 2, -3, 1, 0, 0, 0, 0.5, 0, 0, 0, 0, 0.25, 0.5, *[0] * 20, 2, *[0] * 20,
                1, 12, 4, 2, 100,
            ),
            91,
        ),
    ),
    (telemetry.Statustext(2, "PreArm: no"), frame(253, struct.pack("<B50s", 2, b"PreArm: no"), 83)),
    (telemetry.ExtendedSysState(0, 2), frame(245, struct.pack("<BB", 0, 2), 130)),
]  # fmt: skip


@pytest.mark.parametrize(("message", "golden"), CASES, ids=lambda case: type(case).__name__)
def test_frames_are_those_assembled_by_hand(message, golden):
    assert FrameEncoder(1, 1).encode(message) == golden
    decoded = FrameDecoder().decode(golden)
    assert decoded[:3] == (1, 1, 0)
    assert decoded.message == message


def test_our_messages_have_exactly_the_fields_of_the_dialect():
    assert dialect_faults() == []


def test_known_bytes_of_a_heartbeat():
    """A PX4 heartbeat as printed in the protocol's own examples: 9 bytes of payload, CRC_EXTRA 50."""
    raw = bytes.fromhex("fd09000000010100000000000000020c010303082d")
    assert FrameDecoder().decode(raw).message == telemetry.Heartbeat(2, 12, 1, 0, 3)


def test_many_frames_in_one_datagram_and_what_is_refused():
    whole = b"".join(golden for _, golden in CASES)
    assert [FrameDecoder().decode(raw).message for raw in split(whole)] == [message for message, _ in CASES]
    for data, reason in (
        (b"\xfe\x09\x00\x01\x01\x00", "mavlink_1"),
        (b"\x55\x01", "no_frame"),
        (CASES[0][1][:-1], "truncated"),
        (b"\xfd", "truncated"),
        (b"\xfd\x01\x02" + bytes(12), "incompatible"),
    ):
        with pytest.raises(WireError) as refused:
            list(split(data))
        assert refused.value.reason == reason


# Messages that nothing here decodes: of ArduPilot's dialect (VFR_HUD), of another (STORM32_GIMBAL_MANAGER_STATUS), and
# those of the standard that pymavlink lacks, of which a PX4 in flight sends LINK_NODE_STATUS, TIME_ESTIMATE_TO_TARGET,
# EVENT and CURRENT_EVENT_SEQUENCE: each of their seeds fits the hundreds of such frames in a recording of a real one.
UNUSED = (
    (74, 20, b"\1" * 20),
    (60011, 183, b"\1" * 7),
    (8, 117, b"\1" * 28),
    (380, 232, b"\1" * 20),
    (410, 160, b"\1" * 20),
    (411, 106, b"\1\2\1"),
)


@pytest.mark.parametrize(("number", "extra", "payload"), UNUSED)
def test_a_kind_that_is_not_used_is_verified_like_any_other(number, extra, payload):
    assert FrameDecoder().decode(frame(number, payload, extra, 7)) == (1, 1, 7, None)
    stamp = 30_000_000_000_000
    link = FrameDecoder(Signing(KEY, stamp))
    assert link.decode(signed(number, payload, extra, stamp + 1)).message is None
    broken = bytearray(frame(number, payload, extra))
    broken[12] ^= 2
    for decoder, raw, reason in (
        (FrameDecoder(), bytes(broken), "checksum"),
        (FrameDecoder(), frame(number, payload, extra ^ 1), "checksum"),
        (link, frame(number, payload, extra), "unsigned"),
        (link, signed(number, payload, extra, stamp + 9, key=bytes(32)), "signature"),
        (link, signed(number, payload, extra, stamp + 1), "replayed"),
        (link, signed(number, payload, extra ^ 1, stamp + 9), "checksum"),
    ):
        with pytest.raises(WireError) as refused:
            decoder.decode(raw)
        assert refused.value.reason == reason


def test_broken_checksum_and_unknown_kinds():
    broken = bytearray(CASES[0][1])
    broken[12] ^= 1
    for raw, reason in ((bytes(broken), "checksum"), (frame(9, b"\1\2\3", 0), "unknown_kind")):
        with pytest.raises(WireError) as refused:
            FrameDecoder().decode(raw)
        assert refused.value.reason == reason


def test_no_environment_switches_the_checksum_off(monkeypatch):
    """pymavlink reads MAV_IGNORE_CRC."""
    monkeypatch.setattr(dialect, "MAVLINK_IGNORE_CRC", "1")
    with pytest.raises(WireError, match="checksum"):
        FrameDecoder().decode(CASES[0][1][:-1] + bytes([CASES[0][1][-1] ^ 1]))


def test_unknown_extension_bytes_are_ignored_and_missing_ones_are_zero():
    longer = frame(245, struct.pack("<BB", 0, 2) + b"\7\7", 130)
    assert FrameDecoder().decode(longer).message == telemetry.ExtendedSysState(0, 2)


def test_signed_frames():
    payload = struct.pack("<IBBBBB", 0, 2, 3, 1, 3, 3)
    stamp = 30_000_000_000_000
    link = FrameDecoder(Signing(KEY, stamp))
    beat = link.decode(signed(0, payload, 50, stamp + 1)).message
    assert isinstance(beat, telemetry.Heartbeat) and beat.autopilot == 3
    for raw, reason in (
        (signed(0, payload, 50, stamp + 1), "replayed"),
        (signed(0, payload, 50, stamp), "replayed"),
        (signed(0, payload, 50, stamp + 9, key=bytes(32)), "signature"),
        (frame(0, payload, 50), "unsigned"),
    ):
        with pytest.raises(WireError) as refused:
            link.decode(raw)
        assert refused.value.reason == reason
    # A forged frame with a time far ahead must not lock out the true sender.
    with pytest.raises(WireError):
        link.decode(signed(0, payload, 50, stamp + 10**9, key=bytes(32)))
    assert link.decode(signed(0, payload, 50, stamp + 2)).message is not None
    # An unsigned link takes signed frames as well.
    assert FrameDecoder().decode(signed(0, payload, 50, 5)).message is not None


def test_our_signatures_follow_the_protocols_description():
    stamp = 30_000_000_000_000
    raw = FrameEncoder(255, 190, Signing(KEY, stamp)).encode(telemetry.Heartbeat(6, 8, 0, 0, 4))
    assert len(raw) == 34 and raw[2] == 1
    assert hashlib.sha256(KEY + raw[:-6]).digest()[:6] == raw[-6:]
    assert int.from_bytes(raw[-12:-6], "little") >= stamp


def test_parameters_travel_bytewise_in_px4_and_by_value_in_ardupilot():
    carried = carried_from_value(Flavour.PX4, 11, INT32)
    assert struct.pack("<f", carried) == struct.pack("<i", 11)
    assert value_from_carried(Flavour.PX4, carried, INT32) == 11
    assert carried_from_value(Flavour.PX4, 0.5, REAL32) == 0.5
    assert carried_from_value(Flavour.ARDUPILOT, 1048574, INT32) == 1048574.0


def test_values_that_do_not_fit_are_refused():
    with pytest.raises(WireError, match="unencodable"):
        FrameEncoder(1, 1).encode(telemetry.Heartbeat(999, 12, 0, 0, 4))
