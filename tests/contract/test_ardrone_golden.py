"""The AR.Drone codec against bytes from outside: real packets, and bytes assembled by hand from the protocol sheet."""

import os
import struct
from pathlib import Path

import pytest

from drivers.ardrone.wire import ambient, at, navdata, options
from drivers.ardrone.wire.errors import WireError
from drivers.ardrone.wire.state import ControlState, StateBit, bit_names, split_control_state
from drivers.ardrone.wire.tags import OPTION_SIZES

DATA = Path(os.environ.get("GROUNDSTATION_DATA", Path(__file__).parents[3] / "shared" / "data")) / "ardrone"
REAL = ("ar2-full-1916.bin", "ar2-demo-inflight-500.bin", "ar1-bootstrap-24.bin")


def real(name: str) -> bytes:
    path = DATA / name
    if not path.exists():
        pytest.skip(f"no recorded packet at {path}; set GROUNDSTATION_DATA")
    return path.read_bytes()


@pytest.mark.parametrize("name", REAL)
def test_real_packet_survives_decode_and_encode_byte_by_byte(name):
    datagram = real(name)
    assert navdata.encode(navdata.decode(datagram)) == datagram


@pytest.mark.parametrize("name", REAL)
@pytest.mark.parametrize("layout", options.LAYOUTS, ids=lambda layout: f"{layout.tag.name}-{layout.start}")
def test_each_layout_reproduces_its_bytes_of_a_real_packet(name, layout):
    packet = navdata.decode(real(name))
    value = packet.read(layout)
    if value is None:
        return
    payload = dict(packet.options)[layout.tag]
    own = slice(layout.start - 4, layout.size - 4)
    assert layout.encode(value)[own] == payload[own]


def test_full_packet_of_a_standing_drone():
    packet = navdata.decode(real("ar2-full-1916.bin"))
    assert (packet.sequence, packet.state) == (300711, 0x4F8000D0)
    assert bit_names(packet.state) == (
        "ALTITUDE", "COMMAND", "CAMERA", "PIC_VERSION", "ATCODEC_THREAD", "NAVDATA_THREAD", "VIDEO_THREAD",
        "ACQ_THREAD", "COM_WATCHDOG",
    )  # fmt: skip
    assert [tag for tag, _ in packet.options] == list(range(28))
    assert {tag: len(payload) + 4 for tag, payload in packet.options} == OPTION_SIZES["ar2-2.3"]
    demo = packet.read(options.DEMO)
    assert demo is not None
    assert split_control_state(demo.control_state) == (ControlState.LANDED, 0)
    assert (demo.battery_percent, demo.theta_mdeg, demo.phi_mdeg, demo.psi_mdeg) == (50, 2974.0, 550.0, 1933.0)
    assert demo.altitude_mm == 0
    assert (demo.vx_mm_s, demo.vy_mm_s) == pytest.approx((0.06, -0.88), abs=0.005)
    time = packet.read(options.TIME)
    assert time is not None
    assert time.seconds == pytest.approx(362.979125)
    raw, phys = packet.read(options.RAW_MEASURES), packet.read(options.PHYS_MEASURES)
    assert raw is not None and phys is not None
    assert (raw.battery_mv, raw.accelerometers) == (11686, (2040, 2036, 2528))
    assert phys.accelerations_mg == pytest.approx((80.3, -33.3, -942.5), abs=0.05)
    altitude, pressure, magneto = (
        packet.read(options.ALTITUDE), packet.read(ambient.PRESSURE_RAW), packet.read(ambient.MAGNETO)
    )  # fmt: skip
    assert altitude is not None and pressure is not None and magneto is not None
    assert altitude.raw_mm == 243
    assert (pressure.temperature_decidegree, pressure.pressure_pa) == (435, 101586)
    assert magneto.counts == (30, -56, 80)
    assert magneto.heading_fusion_deg == pytest.approx(1.9, abs=0.05)


def test_demo_packet_in_flight():
    packet = navdata.decode(real("ar2-demo-inflight-500.bin"))
    assert (packet.sequence, packet.state) == (6069, 0x0F8004F5)
    assert packet.state & StateBit.FLY and packet.state & StateBit.NAVDATA_DEMO
    demo = packet.read(options.DEMO)
    assert demo is not None
    assert split_control_state(demo.control_state) == (ControlState.FLYING, 0)
    assert (demo.battery_percent, demo.theta_mdeg, demo.phi_mdeg, demo.psi_mdeg) == (76, -92.0, -440.0, 14668.0)
    assert demo.altitude_mm == 534
    assert (demo.vx_mm_s, demo.vy_mm_s) == pytest.approx((268.48, -195.25), abs=0.005)


def test_bootstrap_packet():
    packet = navdata.decode(real("ar1-bootstrap-24.bin"))
    assert (packet.sequence, packet.state, packet.options) == (1, 0xCFCA0854, ())
    assert packet.state & StateBit.NAVDATA_BOOTSTRAP and packet.state & StateBit.EMERGENCY


def test_real_packet_with_a_wrong_checksum_is_refused():
    with pytest.raises(WireError) as error:
        navdata.decode(real("ar2-demo-badchecksum-500.bin"))
    assert error.value.reason == "checksum"


def test_packet_assembled_by_hand():
    # Header, EULER_ANGLES (tag 5, size 12, theta 1000.0, phi -2.0 mdeg), checksum: the plain sum of the bytes before.
    body = bytes.fromhex("88776655 90008080 07000000 01000000 0500 0c00 00007a44 000000c0")
    total = 0x88 + 0x77 + 0x66 + 0x55 + 0x90 + 0x80 + 0x80 + 7 + 1 + 5 + 12 + 0x7A + 0x44 + 0xC0
    datagram = body + bytes.fromhex("ffff 0800") + struct.pack("<I", total)
    packet = navdata.decode(datagram)
    assert (packet.state, packet.sequence, packet.vision_defined) == (0x80800090, 7, 1)
    assert packet.read(options.EULER_ANGLES) == (1000.0, -2.0)
    value = options.EULER_ANGLES.encode(options.EulerAngles(1000.0, -2.0))
    assert navdata.encode(navdata.Navdata(0x80800090, 7, 1, ((5, value),))) == datagram


def test_demo_offsets_assembled_by_hand():
    payload = bytearray(144)
    struct.pack_into("<I", payload, 0, 4 << 16)
    struct.pack_into("<I", payload, 4, 77)
    for offset, value in ((8, -5000.0), (12, 2500.0), (16, 90000.0), (24, 1500.0), (28, -250.0), (32, 30.0)):
        struct.pack_into("<f", payload, offset, value)
    struct.pack_into("<i", payload, 20, 812)
    assert options.DEMO.decode(bytes(payload)) == (4 << 16, 77, -5000.0, 2500.0, 90000.0, 812, 1500.0, -250.0, 30.0, 0)


@pytest.mark.parametrize(
    ("value", "bits"),
    [
        (0.0, 0), (0.05, 1028443341), (0.1, 1036831949), (0.2, 1045220557), (0.5, 1056964608), (0.75, 1061158912),
        (0.8, 1061997773), (1.0, 1065353216), (2.0, 1073741824), (-0.1, -1110651699), (-0.2, -1102263091),
        (-0.3, -1097229926), (-0.5, -1090519040), (-0.8, -1085485875), (-1.0, -1082130432),
    ],
)  # fmt: skip
def test_float_arguments_of_the_sheet(value, bits):
    assert at.bits_from_float(value) == bits
    assert at.float_from_bits(bits) == pytest.approx(value, rel=1e-6)


@pytest.mark.parametrize(
    ("command", "line"),
    [
        (at.ref(start=True), b"AT*REF=7,290718208\r"),
        (at.ref(start=False), b"AT*REF=7,290717696\r"),
        (at.ref(start=False, select=True), b"AT*REF=7,290717952\r"),
        (at.pcmd(at.Motion()), b"AT*PCMD=7,0,0,0,0,0\r"),
        (at.pcmd(at.Motion(1, -0.8, 0.5, 0.1, -1.0)), b"AT*PCMD=7,1,-1085485875,1056964608,1036831949,-1082130432\r"),
        (at.pcmd_mag(at.Motion(5, psi=0.5)), b"AT*PCMD_MAG=7,5,0,0,0,0,1056964608,0\r"),
        (at.ftrim(), b"AT*FTRIM=7\r"),
        (at.calib(), b"AT*CALIB=7,0\r"),
        (at.config("general:navdata_demo", "FALSE"), b'AT*CONFIG=7,"general:navdata_demo","FALSE"\r'),
        (at.config_ids("aabbccdd", "00000000", "11223344"), b'AT*CONFIG_IDS=7,"aabbccdd","00000000","11223344"\r'),
        (at.ctrl(at.CTRL_ACK), b"AT*CTRL=7,5,0\r"),
        (at.comwdg(), b"AT*COMWDG=7\r"),
        (at.led(6, 2.0, 3), b"AT*LED=7,6,1073741824,3\r"),
        (at.anim(6, 5000), b"AT*ANIM=7,6,5000\r"),
        (at.mtrim(0.1, -0.2, 0.0), b"AT*MTRIM=7,1036831949,-1102263091,0\r"),
        (at.pmode(2), b"AT*PMODE=7,2\r"),
        (at.misc(2, 20, 2000, 3000), b"AT*MISC=7,2,20,2000,3000\r"),
    ],
    ids=lambda value: value.name if isinstance(value, at.AtCommand) else "",
)
def test_command_lines_of_the_sheet(command, line):
    assert at.encode(command, 7) == line
    assert at.decode_datagram(line, strict=True) == [command._replace(sequence=7)]
