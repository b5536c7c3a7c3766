"""The AR.Drone codec against real packets and bytes assembled by hand (docs/reference/ardrone.md 2, 4)."""

import struct

import pytest

from drivers.ardrone.wire import ambient, at, navdata, options
from drivers.ardrone.wire.errors import WireError
from drivers.ardrone.wire.state import ControlState, StateBit, bit_names, split_control_state
from drivers.ardrone.wire.tags import OPTION_SIZES

OURS = ("full-landed", "demo-flying", "bootstrap")
REAL = ("ar2-full-1916.bin", "ar2-demo-inflight-500.bin", "ar1-bootstrap-24.bin")


@pytest.fixture
def real(real_data):
    return lambda name: real_data(f"ardrone/{name}").read_bytes()


def reproduced(datagram, layout):
    """Return whether a layout re-encodes to the bytes that it was decoded from, where the packet has it."""
    packet = navdata.decode(datagram)
    value = packet.read(layout)
    if value is None:
        return True
    own = slice(layout.start - 4, layout.size - 4)
    return layout.encode(value)[own] == dict(packet.options)[layout.tag][own]


@pytest.mark.parametrize("layout", options.LAYOUTS, ids=lambda layout: f"{layout.tag.name}-{layout.start}")
@pytest.mark.parametrize("name", OURS)
def test_each_layout_reproduces_its_bytes_of_our_packet(golden_packet, name, layout):
    assert reproduced(golden_packet(name), layout)


@pytest.mark.parametrize("name", OURS)
def test_our_packet_survives_decode_and_encode_byte_by_byte(golden_packet, name):
    assert navdata.encode(navdata.decode(golden_packet(name))) == golden_packet(name)


@pytest.mark.parametrize("name", REAL)
def test_real_packet_survives_decode_and_encode_byte_by_byte(real, name):
    assert navdata.encode(navdata.decode(real(name))) == real(name)
    assert not [layout.tag.name for layout in options.LAYOUTS if not reproduced(real(name), layout)]


def test_our_full_packet(golden_packet):
    packet = navdata.decode(golden_packet("full-landed"))
    assert (packet.sequence, packet.state, packet.vision_defined) == (4711, 0x0F8000D0, 0)
    assert {tag: len(payload) + 4 for tag, payload in packet.options} == OPTION_SIZES["ar2-2.3"]
    read = {layout: value for layout in options.LAYOUTS if (value := packet.read(layout)) is not None}
    demo = read[options.DEMO]
    assert split_control_state(demo.control_state) == (ControlState.LANDED, 0)
    assert demo[1:9] == (87, 1500.0, -750.0, -12250.0, 0, 0.25, -0.5, 0.0)
    assert read[options.TIME].seconds == pytest.approx(12.345678)
    assert (read[options.RAW_MEASURES].battery_mv, read[options.RAW_ECHOES].altitude_mm) == (11900, 240)
    assert read[options.PHYS_MEASURES].accelerations_mg == (26.0, -13.0, -996.0)
    assert read[options.SPEED_REFERENCES].sequence == 4321
    assert read[options.PWM].currents_ma == (13, 14, 15, 16)
    assert (read[options.ALTITUDE].raw_mm, read[options.ALTITUDE].vz_mm_s) == (240, -1.5)
    assert read[ambient.PRESSURE_RAW][2:] == (421, 100950)
    assert (read[ambient.MAGNETO].counts, read[ambient.MAGNETO].heading_fusion_deg) == ((31, -57, 82), -12.25)
    assert set(options.LAYOUTS) - set(read) == {ambient.GPS}, "this firmware has the older option of that number"


def test_our_demo_packet_in_flight(golden_packet):
    packet = navdata.decode(golden_packet("demo-flying"))
    assert packet.state & StateBit.FLY and packet.state & StateBit.NAVDATA_DEMO
    demo = packet.read(options.DEMO)
    assert demo is not None
    assert split_control_state(demo.control_state) == (ControlState.FLYING, 5)
    assert demo[1:9] == (64, -2750.0, 1250.0, 91500.0, 1180, 412.5, -87.25, 0.0)


def test_our_bootstrap_packet(golden_packet):
    packet = navdata.decode(golden_packet("bootstrap"))
    assert (packet.sequence, packet.options) == (1, ())
    assert packet.state & StateBit.NAVDATA_BOOTSTRAP and not packet.state & StateBit.FLY


@pytest.mark.parametrize("name", OURS)
def test_our_packet_with_any_other_sum_is_refused(golden_packet, name):
    damaged = bytearray(golden_packet(name))
    damaged[8] ^= 1  # the sequence number
    with pytest.raises(WireError) as error:
        navdata.decode(bytes(damaged))
    assert error.value.reason == "checksum"


def test_full_packet_of_a_standing_drone(real):
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


def test_demo_packet_in_flight(real):
    packet = navdata.decode(real("ar2-demo-inflight-500.bin"))
    assert (packet.sequence, packet.state) == (6069, 0x0F8004F5)
    assert packet.state & StateBit.FLY and packet.state & StateBit.NAVDATA_DEMO
    demo = packet.read(options.DEMO)
    assert demo is not None
    assert split_control_state(demo.control_state) == (ControlState.FLYING, 0)
    assert (demo.battery_percent, demo.theta_mdeg, demo.phi_mdeg, demo.psi_mdeg) == (76, -92.0, -440.0, 14668.0)
    assert demo.altitude_mm == 534
    assert (demo.vx_mm_s, demo.vy_mm_s) == pytest.approx((268.48, -195.25), abs=0.005)


def test_bootstrap_packet(real):
    packet = navdata.decode(real("ar1-bootstrap-24.bin"))
    assert (packet.sequence, packet.state, packet.options) == (1, 0xCFCA0854, ())
    assert packet.state & StateBit.NAVDATA_BOOTSTRAP and packet.state & StateBit.EMERGENCY


def test_real_packet_with_a_wrong_checksum_is_refused(real):
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
        (at.pcmd(at.ProgressiveMotion()), b"AT*PCMD=7,0,0,0,0,0\r"),
        (
            at.pcmd(at.ProgressiveMotion(1, -0.8, 0.5, 0.1, -1.0)),
            b"AT*PCMD=7,1,-1085485875,1056964608,1036831949,-1082130432\r",
        ),
        (at.AtCommand("PCMD_MAG", (5, 0, 0, 0, 0, 1056964608, 0)), b"AT*PCMD_MAG=7,5,0,0,0,0,1056964608,0\r"),
        (at.ftrim(), b"AT*FTRIM=7\r"),
        (at.AtCommand("CALIB", (0,)), b"AT*CALIB=7,0\r"),
        (at.config("general:navdata_demo", "FALSE"), b'AT*CONFIG=7,"general:navdata_demo","FALSE"\r'),
        (at.config_ids("aabbccdd", "00000000", "11223344"), b'AT*CONFIG_IDS=7,"aabbccdd","00000000","11223344"\r'),
        (at.ctrl(at.CTRL_ACK), b"AT*CTRL=7,5,0\r"),
        (at.comwdg(), b"AT*COMWDG=7\r"),
        (at.led(6, 2.0, 3), b"AT*LED=7,6,1073741824,3\r"),
        (at.AtCommand("ANIM", (6, 5000)), b"AT*ANIM=7,6,5000\r"),
        (at.AtCommand("MTRIM", (1036831949, -1102263091, 0)), b"AT*MTRIM=7,1036831949,-1102263091,0\r"),
        (at.AtCommand("PMODE", (2,)), b"AT*PMODE=7,2\r"),
        (at.AtCommand("MISC", (2, 20, 2000, 3000)), b"AT*MISC=7,2,20,2000,3000\r"),
    ],
    ids=lambda value: value.name if isinstance(value, at.AtCommand) else "",
)
def test_command_lines_of_the_sheet(command, line):
    assert at.encode(command, 7) == line
    assert at.decode_datagram(line, strict=True) == [command._replace(sequence=7)]
