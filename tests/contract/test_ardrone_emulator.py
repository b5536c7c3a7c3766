"""The emulator over real loopback UDP, with bytes assembled by hand from the protocol sheet.

Neither the driver's encoders nor its decoders take part: offsets, signs and commands are written out here.
"""

import itertools
import math
import os
import socket
import struct
from collections.abc import Iterator
from pathlib import Path

import pytest

from groundstation.errors import GroundStationError
from sim_bridge.devices.ardrone import ArDroneEmulator
from sim_bridge.scenario import DroneScenario, Scenario
from sim_bridge.site import Site
from sim_bridge.world.world import World

ONE, HALF, MINUS_HALF, MINUS_ONE = 1065353216, 1056964608, -1090519040, -1082130432
TAKE_OFF, LAND, EMERGENCY = 290718208, 290717696, 290717952
FLY, START, COMMAND, DEMO, BOOTSTRAP, COM_LOST, VBAT_LOW = 1 << 0, 1 << 5, 1 << 6, 1 << 10, 1 << 11, 1 << 13, 1 << 15
COM_WATCHDOG, EMERGENCY_BIT = 1 << 30, 1 << 31
_addresses = itertools.count(1)


class Bench:
    """One emulated drone on an address of its own, a client socket pair, and a hand on the clock."""

    def __init__(self, scenario: DroneScenario | None = None) -> None:
        pid = os.getpid()
        self.address = f"127.{100 + pid % 100}.{pid // 100 % 250}.{next(_addresses)}"
        site = Site.model_validate(
            {
                "site": "lab",
                "room": {"size_m": [8, 6, 4.5]},
                "drones": {
                    "d": {
                        "kind": "ardrone",
                        "pad_m": [0, 0],
                        "marker": {"code": 1, "square_mm": 44, "position_m": [0, 0, 0]},
                    }
                },
                "target": {"name": "t", "marker": {"code": 5, "height_m": 0.4, "square_mm": 44}},
            }
        )
        self.world = World(site, Scenario(drones=scenario or DroneScenario()), 1)
        drone, onboard = self.world.drones["d"], self.world.onboard["d"]
        self.body, self.autopilot = drone.airframe, drone.autopilot
        self.emulator = ArDroneEmulator("d", self.address, drone, onboard)
        self.navdata = self.client()
        self.at = self.client()
        self.sequence = 0
        self.packets: list[bytes] = []

    @staticmethod
    def client() -> socket.socket:
        udp = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        udp.bind(("127.0.0.1", 0))
        udp.setblocking(False)
        return udp

    def close(self) -> None:
        self.emulator.close()
        self.navdata.close()
        self.at.close()

    def tick(self, count: int = 1) -> list[bytes]:
        """Advance by 5 ms each and return the packets that came."""
        came = []
        for _ in range(count):
            self.emulator.receive_navdata_requests()
            self.emulator.receive_commands()
            self.world.step()
            self.emulator.send()
            came += receive(self.navdata)
        self.packets += came
        return came

    def raw(self, datagram: bytes) -> None:
        self.at.sendto(datagram, (self.address, 5556))

    def say(self, *commands: str) -> None:
        """Send commands such as `REF,290718208` in one datagram."""
        lines = []
        for command in commands:
            self.sequence += 1
            name, _, arguments = command.partition(",")
            lines.append(f"AT*{name}={self.sequence}{',' + arguments if arguments else ''}\r")
        self.raw("".join(lines).encode())

    def request(self, payload: bytes = b"\x01\x00\x00\x00") -> None:
        self.navdata.sendto(payload, (self.address, 5554))

    def connect(self, demo: str = "FALSE") -> None:
        """Bootstrap to streaming."""
        self.request()
        self.say(f'CONFIG,"general:navdata_demo","{demo}"')
        self.tick(4 * 13)
        self.say("CTRL,5,0")
        self.tick(2)

    def keep(self, seconds: float, *commands: str) -> None:
        """Send commands every 30 ms for a while, as a driver does."""
        for _ in range(round(seconds / 0.03)):
            self.say(*(commands or ("COMWDG",)))
            self.tick(6)

    def fly(self) -> None:
        self.connect()
        self.keep(0.1, f"REF,{LAND}", "PCMD,0,0,0,0,0")
        self.keep(6.0, f"REF,{TAKE_OFF}", "PCMD,0,0,0,0,0")
        assert not self.body.on_ground

    @property
    def state(self) -> int:
        return int(struct.unpack_from("<I", self.packets[-1], 4)[0])

    @property
    def major(self) -> int:
        return self.demo()[0] >> 16

    def demo(self) -> tuple[int, int, float, float, float, int, float, float, float]:
        """Return control state, battery, theta, phi, psi [mdeg], altitude [mm], vx, vy, vz [mm/s]."""
        assert struct.unpack_from("<HH", self.packets[-1], 16) == (0, 148)
        return struct.unpack_from("<IIfffifff", self.packets[-1], 20)  # type: ignore[return-value]


def receive(udp: socket.socket) -> list[bytes]:
    packets = []
    while True:
        try:
            packets.append(udp.recv(4096))
        except BlockingIOError:
            return packets


@pytest.fixture
def bench() -> Iterator[Bench]:
    made = Bench()
    yield made
    made.close()


def options(packet: bytes) -> list[tuple[int, int]]:
    found, offset = [], 16
    while offset < len(packet):
        tag, size = struct.unpack_from("<HH", packet, offset)
        found.append((tag, size))
        offset += size
    return found


def test_silent_until_asked(bench: Bench) -> None:
    assert bench.tick(40) == []
    bench.say("COMWDG")
    assert bench.tick(40) == []


@pytest.mark.parametrize("payload", [b"\x01", b"\x01\x00\x00\x00", b"1", b"\x01" + b"\x00" * 13])
def test_any_request_brings_a_bootstrap_packet_to_its_sender(bench: Bench, payload: bytes) -> None:
    bench.request(payload)
    packet = bench.tick()[0]
    magic, state, sequence, vision = struct.unpack_from("<IIII", packet)
    assert (len(packet), magic, sequence, vision) == (24, 0x55667788, 1, 0)
    assert state & BOOTSTRAP
    assert not state & FLY
    assert struct.unpack_from("<HHI", packet, 16) == (0xFFFF, 8, sum(packet[:16]))


def test_bootstrap_goes_on_at_the_demo_rate_while_requests_come(bench: Bench) -> None:
    bench.request()
    bench.tick()
    packets = bench.tick(13 * 10)
    assert len(packets) == 10
    assert {len(packet) for packet in packets} == {24}


def test_requests_every_100_ms_do_not_restart_the_session(bench: Bench) -> None:
    bench.connect()
    for _ in range(5):
        bench.request()
        bench.say("COMWDG")
        bench.tick(20)
    sequences = [struct.unpack_from("<I", packet, 8)[0] for packet in bench.packets]
    assert sequences == list(range(1, len(sequences) + 1))
    assert not bench.state & BOOTSTRAP


def test_full_mode_is_200_hz_with_the_options_of_a_real_drone(bench: Bench) -> None:
    bench.connect()
    assert len(bench.tick(10)) == 10
    packet = bench.packets[-1]
    assert len(packet) == 1916
    assert not bench.state & (DEMO | BOOTSTRAP)
    assert struct.unpack_from("<I", packet, len(packet) - 4)[0] == sum(packet[:-8])
    fixture = real_packet("ar2-full-1916.bin")
    assert options(packet) == options(fixture)


def test_a_landed_drone_says_what_a_real_one_said(bench: Bench) -> None:
    bench.connect()
    bench.tick()
    real, ours = real_packet("ar2-full-1916.bin"), bench.packets[-1]
    assert struct.unpack_from("<I", ours, 20) == struct.unpack_from("<I", real, 20), "control state"
    assert struct.unpack_from("<i", ours, 40)[0] == struct.unpack_from("<i", real, 40)[0] == 0, "altitude"
    start = {}
    offset = 16
    for tag, size in options(real):
        start[tag] = offset
        offset += size
    for tag, place, form, tolerance in (
        (2, 4, "<H", 60),  # accelerometer LSB, x
        (2, 8, "<H", 80),  # and z
        (2, 46, "<i", 20),  # ultrasound on the ground
        (3, 18, "<f", 60.0),  # mg, z down: gravity is negative
        (21, 14, "<i", 1),  # pressure
    ):
        mine = struct.unpack_from(form, ours, start[tag] + place)[0]
        theirs = struct.unpack_from(form, real, start[tag] + place)[0]
        assert mine == pytest.approx(theirs, abs=tolerance), (tag, place)


def real_packet(name: str) -> bytes:
    folder = Path(os.environ.get("GROUNDSTATION_DATA") or Path(__file__).parents[3] / "shared" / "data")
    path = folder / "ardrone" / name
    if not path.exists():
        pytest.skip(f"{path} is absent: recordings of real drones are not part of the repository")
    return path.read_bytes()


def test_demo_mode_is_15_hz_with_500_bytes(bench: Bench) -> None:
    bench.connect("TRUE")
    bench.keep(0.3)
    del bench.packets[:]
    bench.keep(1.56)
    demo = [packet for packet in bench.packets if len(packet) == 500]
    assert len(demo) == pytest.approx(1.56 * 200 / 13, abs=1)
    assert options(demo[0]) == [(0, 148), (16, 328), (0xFFFF, 8)]
    assert bench.state & DEMO
    assert options(demo[0]) == options(real_packet("ar2-demo-inflight-500.bin"))


def test_navdata_options_choose_what_demo_mode_sends(bench: Bench) -> None:
    bench.connect("TRUE")
    bench.say(f'CONFIG,"general:navdata_options","{1 << 0 | 1 << 10 | 1 << 16}"')
    bench.tick(30)
    assert [tag for tag, _ in options(bench.packets[-1])] == [0, 10, 16, 0xFFFF]


def test_config_in_demo_mode_brings_a_status_only_packet(bench: Bench) -> None:
    bench.connect("TRUE")
    bench.tick(13)
    bench.say('CONFIG,"control:altitude_max","2500"')
    packets = bench.tick(1)
    assert [len(packet) for packet in packets] == [24]
    assert bench.state & COMMAND


def test_the_ack_bit_is_held_for_two_packets(bench: Bench) -> None:
    bench.connect()
    assert not bench.state & COMMAND
    bench.say('CONFIG,"control:altitude_max","2500"', "CTRL,5,0")
    states = [struct.unpack_from("<I", packet, 4)[0] & COMMAND for packet in bench.tick(4)]
    assert states == [COMMAND, COMMAND, 0, 0]
    assert bench.autopilot.limits.height_m == 2.5


def test_the_ack_bit_stays_until_it_is_acknowledged(bench: Bench) -> None:
    bench.connect()
    bench.say('CONFIG,"control:altitude_max","2500"')
    bench.keep(1.0)
    assert bench.state & COMMAND
    bench.say('CONFIG,"control:altitude_max","1500"')
    bench.tick(2)
    assert bench.autopilot.limits.height_m == 2.5, "a second CONFIG before the ack is lost"
    bench.say("CTRL,5,0")
    bench.tick(2)
    assert not bench.state & COMMAND


def test_bootstrap_ends_with_the_ack(bench: Bench) -> None:
    bench.request()
    bench.say('CONFIG,"general:navdata_demo","FALSE"')
    bench.tick(30)
    assert bench.state & BOOTSTRAP
    assert bench.state & COMMAND
    bench.say("CTRL,5,0")
    bench.tick(2)
    assert not bench.state & BOOTSTRAP


def test_clients_that_never_acknowledge_get_navdata_all_the_same(bench: Bench) -> None:
    bench.request()
    bench.say('CONFIG,"general:navdata_demo","TRUE"')
    bench.keep(1.5)
    assert len(bench.packets[-1]) == 500


def test_limits_are_clamped_and_applied(bench: Bench) -> None:
    bench.connect()
    for key, value in (
        ("control:euler_angle_max", "0.1"),
        ("CONTROL:control_vz_max", "9000"),
        ("control:control_yaw", "3.0"),
    ):
        bench.say(f'CONFIG,"{key}","{value}"')
        bench.tick(3)
        bench.say("CTRL,5,0")
        bench.tick(3)
    limits = bench.autopilot.limits
    assert (limits.tilt_rad, limits.climb_m_s, limits.yaw_rate_rad_s) == pytest.approx((0.1, 2.0, 3.0))


def test_multi_configuration_wants_the_active_ids(bench: Bench) -> None:
    bench.connect()
    for commands in (
        ('CONFIG,"custom:session_id","1234abcd"',),
        ('CONFIG_IDS,"00000000","00000000","00000000"', 'CONFIG,"control:euler_angle_max","0.1"'),
        ('CONFIG_IDS,"1234abcd","00000000","00000000"', 'CONFIG,"control:euler_angle_max","0.2"'),
    ):
        bench.say(*commands)
        bench.tick(3)
        bench.say("CTRL,5,0")
        bench.tick(3)
        assert bench.autopilot.limits.tilt_rad != pytest.approx(0.1)
    assert bench.autopilot.limits.tilt_rad == pytest.approx(0.2)


def test_outdoor_selects_the_outdoor_limits(bench: Bench) -> None:
    bench.connect()
    bench.say('CONFIG,"control:outdoor","true"')
    bench.tick(2)
    limits = bench.autopilot.limits
    assert (limits.tilt_rad, limits.climb_m_s) == pytest.approx((0.3490658, 1.0), abs=1e-6)


def test_old_sequence_numbers_are_ignored_and_one_resets(bench: Bench) -> None:
    bench.connect()
    bench.raw(b"AT*REF=100,290718208\r")
    bench.tick()
    assert bench.state & START
    bench.raw(b"AT*REF=99,290717696\r")
    bench.raw(b"AT*REF=100,290717696\r")
    bench.tick()
    assert bench.state & START
    bench.raw(b"AT*REF=1,290717696\r")
    bench.tick()
    assert not bench.state & START
    bench.raw(b"AT*REF=2,290718208\r")
    bench.tick()
    assert bench.state & START


def test_after_silence_any_number_is_a_new_base(bench: Bench) -> None:
    bench.connect()
    bench.raw(b"AT*COMWDG=5000\r")
    bench.tick(450)
    bench.raw(b"AT*REF=7,512\r")
    bench.request()
    bench.tick(14)
    assert bench.state & START


def test_com_watchdog_after_50_ms(bench: Bench) -> None:
    bench.connect()
    bench.say("COMWDG")
    bench.tick(10)
    assert not bench.state & COM_WATCHDOG
    bench.tick(3)
    assert bench.state & COM_WATCHDOG
    assert not bench.state & COM_LOST
    bench.raw(b"\r")
    bench.tick()
    assert not bench.state & COM_WATCHDOG, "any traffic feeds it"


def test_two_seconds_of_silence_end_the_stream(bench: Bench) -> None:
    bench.connect()
    came = bench.tick(500)
    assert len(came) == pytest.approx(400, abs=5)
    assert bench.tick(200) == []
    bench.request()
    packet = bench.tick()[0]
    assert struct.unpack_from("<I", packet, 8)[0] == 1, "a new session counts from 1"
    assert bench.state & BOOTSTRAP
    assert bench.state & COM_LOST


def test_a_new_client_takes_over(bench: Bench) -> None:
    bench.connect()
    other = bench.client()
    other.sendto(b"\x01", (bench.address, 5554))
    assert bench.tick(14) == []
    assert struct.unpack_from("<I", receive(other)[0], 8)[0] == 1
    other.close()


def test_take_off_reports_the_phases(bench: Bench) -> None:
    bench.connect()
    seen = []
    for _ in range(200):
        bench.say(f"REF,{TAKE_OFF}", "PCMD,0,0,0,0,0")
        bench.tick(6)
        seen.append((bench.major, bool(bench.state & FLY)))
    assert [phase for phase, _ in itertools.groupby(seen)] == [(6, True), (4, True)]
    bench.keep(0.5, "PCMD,1,0,0,0,0")
    assert bench.major == 3
    bench.keep(0.3, "PCMD,1,0,-1085485875,0,0")
    bench.keep(0.1, "PCMD,0,0,0,0,0")
    assert bench.major == 7
    bench.keep(3.0, "PCMD,0,0,0,0,0")
    assert bench.major == 4
    bench.keep(0.1, f"REF,{LAND}")
    assert bench.major == 8
    bench.keep(4.0, f"REF,{LAND}")
    assert bench.major == 2
    assert not bench.state & FLY


@pytest.mark.parametrize("bits", [512, 290718208])
def test_ref_is_latched_and_its_base_bits_do_not_matter(bench: Bench, bits: int) -> None:
    bench.connect()
    bench.say(f"REF,{bits}")
    bench.keep(6.0)
    assert bench.major == 4
    assert bench.demo()[5] > 500


def test_land_and_start_again(bench: Bench) -> None:
    bench.fly()
    bench.keep(5.0, f"REF,{LAND}")
    assert bench.body.on_ground
    bench.keep(5.0, "COMWDG")
    assert bench.body.on_ground
    bench.keep(5.0, f"REF,{TAKE_OFF}")
    assert not bench.body.on_ground


def test_signs_on_the_wire(bench: Bench) -> None:
    """theta < 0 forward, phi > 0 right, gaz > 0 up, yaw > 0 clockwise; DEMO: theta nose up, psi clockwise."""
    bench.fly()
    yaw = bench.body.yaw
    bench.keep(0.6, f"PCMD,1,0,{MINUS_ONE},0,0")
    assert bench.body.vx * math.cos(yaw) + bench.body.vy * math.sin(yaw) > 0.5
    _, _, theta, _, _, _, vx, _, vz = bench.demo()
    assert theta < -7000
    assert vx > 300
    assert vz == 0.0
    bench.keep(2.0, "PCMD,0,0,0,0,0")
    bench.keep(0.6, f"PCMD,1,{ONE},0,0,0")
    _, _, _, phi, _, _, _, vy, _ = bench.demo()
    assert bench.body.vx * math.sin(yaw) - bench.body.vy * math.cos(yaw) > 0.5
    assert phi > 7000
    assert vy > 300
    bench.keep(2.0, "PCMD,0,0,0,0,0")
    psi, height, altitude = bench.demo()[4], bench.body.z, bench.demo()[5]
    bench.keep(1.0, f"PCMD,1,0,0,{HALF},{HALF}")
    assert bench.body.z > height + 0.05
    assert bench.demo()[5] > altitude + 30
    assert math.remainder(bench.body.yaw - yaw, math.tau) < -0.2
    assert math.remainder(bench.demo()[4] - psi, 360000) > 10000


def test_yaw_jumps_at_lift_off(bench: Bench) -> None:
    bench.connect()
    bench.keep(1.0, f"REF,{LAND}")
    grounded = bench.demo()[4]
    assert abs(grounded) < 2000
    bench.keep(5.0, f"REF,{TAKE_OFF}", "PCMD,0,0,0,0,0")
    assert 55_000 < abs(math.remainder(bench.demo()[4] - grounded, 360000)) < 150_000
    assert abs(bench.body.yaw) < 0.1


def test_values_beyond_one_are_clamped(bench: Bench) -> None:
    bench.fly()
    bench.keep(1.5, "PCMD,1,0,-1069547520,0,0")  # -3.0
    assert bench.demo()[2] > -16000


def test_the_last_pcmd_is_held_while_the_link_lives(bench: Bench) -> None:
    bench.fly()
    bench.say(f"PCMD,1,0,{MINUS_HALF},0,0")
    bench.keep(1.0, "COMWDG")
    assert math.hypot(bench.body.vx, bench.body.vy) > 0.4
    bench.tick(100)
    assert bench.body.pitch > 0.05, "half a second of silence changes nothing"


def test_silence_in_flight_hovers_then_lands(bench: Bench) -> None:
    bench.fly()
    bench.say(f"PCMD,1,{MINUS_HALF},0,0,0")
    bench.tick(395)
    assert bench.body.roll < -0.05
    bench.tick(110)
    assert abs(bench.body.roll) < 0.25
    assert not bench.body.on_ground
    bench.tick(150)
    assert bench.autopilot.phase.name == "LANDING"
    bench.tick(1200)
    assert bench.body.on_ground
    assert not bench.autopilot.motors_on


def test_nothing_takes_off_by_itself_after_a_lost_link(bench: Bench) -> None:
    bench.fly()
    bench.tick(2400)
    assert bench.body.on_ground
    bench.sequence += 1000
    bench.request()
    bench.keep(6.0, f"REF,{TAKE_OFF}")
    assert bench.body.on_ground, "a start button that was never released is no new press"


def test_a_client_that_comes_back_in_flight_finds_it_flying(bench: Bench) -> None:
    bench.fly()
    bench.tick(420)
    bench.sequence = 0
    bench.request()
    bench.say(f"REF,{TAKE_OFF}", "PCMD,0,0,0,0,0")
    bench.tick(13)
    assert bench.state & FLY
    assert bench.state & BOOTSTRAP
    bench.keep(2.0, f"REF,{TAKE_OFF}", "PCMD,0,0,0,0,0")
    assert not bench.body.on_ground


def test_emergency_toggles_on_the_rising_edge(bench: Bench) -> None:
    bench.fly()
    bench.keep(0.3, f"REF,{EMERGENCY}")
    assert bench.state & EMERGENCY_BIT
    assert bench.state & 1 << 16
    assert not bench.autopilot.motors_on
    bench.keep(2.0, f"REF,{EMERGENCY}")
    assert bench.state & EMERGENCY_BIT, "held, it does not toggle again"
    bench.keep(0.1, f"REF,{LAND}")
    bench.keep(5.0, f"REF,{TAKE_OFF}")
    assert bench.body.on_ground, "refused while in emergency"
    bench.keep(0.1, f"REF,{LAND}")
    bench.keep(0.1, f"REF,{EMERGENCY}")
    assert not bench.state & EMERGENCY_BIT
    bench.keep(0.1, f"REF,{LAND}")
    bench.keep(5.0, f"REF,{TAKE_OFF}")
    assert not bench.body.on_ground


def test_a_low_battery_refuses_take_off_and_ends_a_flight() -> None:
    bench = Bench(DroneScenario(battery=(0.09, 0.09)))
    bench.connect()
    bench.keep(5.0, f"REF,{TAKE_OFF}")
    assert bench.state & VBAT_LOW
    assert bench.demo()[1] == 9
    assert bench.body.on_ground
    bench.world.drones["d"].battery = 0.5
    bench.keep(0.1, f"REF,{LAND}")
    bench.keep(6.0, f"REF,{TAKE_OFF}")
    assert not bench.state & VBAT_LOW
    bench.world.drones["d"].battery = 0.04
    bench.keep(5.0, f"REF,{TAKE_OFF}")
    assert bench.body.on_ground
    bench.close()


@pytest.mark.parametrize(
    "line", [b"AT*COMWDG=%d,\r", b"AT*FTRIM=%d,\r", b"AT*PMODE=%d,2\r", b"AT*MISC=%d,2,20,2000,3000\r", b"garbage%d\r"]
)
def test_odd_but_harmless_lines_keep_the_link(bench: Bench, line: bytes) -> None:
    bench.connect()
    bench.tick(20)
    assert bench.state & COM_WATCHDOG
    bench.raw(line % 1000 + b"AT*REF=1001,512\r")
    bench.tick()
    assert not bench.state & COM_WATCHDOG
    assert bench.state & START


@pytest.mark.parametrize("line", [b"AT*REF=900,512\n", b"AT*REF=900,512", b"at*ref=900,512\r", b"AT*REF=900,0.5\r"])
def test_what_a_real_codec_ignores_is_ignored(bench: Bench, line: bytes) -> None:
    bench.connect()
    bench.raw(line)
    bench.tick()
    assert not bench.state & START


def test_nonfinite_motion_is_ignored(bench: Bench) -> None:
    bench.fly()
    bench.keep(0.5, "PCMD,1,2143289344,2139095040,0,0")  # NaN, infinity
    assert bench.autopilot.phase.name == "HOVERING"
    assert all(map(math.isfinite, bench.demo()))


def test_time_and_height_options(bench: Bench) -> None:
    bench.fly()
    packet = bench.packets[-1]
    offsets, offset = {}, 16
    for tag, size in options(packet):
        offsets[tag] = offset
        offset += size
    bits = struct.unpack_from("<I", packet, offsets[1] + 4)[0]
    assert (bits >> 21) + (bits & 0x1FFFFF) / 1e6 == pytest.approx(bench.world.time_s, abs=0.01)
    vision, climb, reference, raw = struct.unpack_from("<ifii", packet, offsets[10] + 4)
    assert vision == reference == raw == bench.demo()[5]
    assert abs(climb) < 300
    heading = struct.unpack_from("<f", packet, offsets[22] + 54)[0]
    assert heading == pytest.approx(bench.demo()[4] / 1000, abs=1e-3), "degrees, equal to psi"
    assert struct.unpack_from("<i", packet, offsets[6] + 84)[0] > 0, "ui_seq: the last PCMD"


def test_a_taken_port_is_named() -> None:
    bench = Bench()
    with pytest.raises(GroundStationError, match=rf"{bench.address}:5554 \(UDP\)"):
        ArDroneEmulator("d", bench.address, bench.world.drones["d"], bench.world.onboard["d"])
    bench.close()


def test_faults_silence_and_deafen(bench: Bench) -> None:
    bench.connect()
    bench.emulator.silent = True
    bench.say("COMWDG")
    assert bench.tick(10) == []
    bench.emulator.silent = False
    bench.emulator.deaf = True
    bench.keep(1.0)
    assert bench.state & COM_WATCHDOG
