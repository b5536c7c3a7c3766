"""The emulator in flight over real loopback UDP: phases, signs, latches, lost links, emergencies, odd datagrams.

The bench (conftest.py) assembles and reads bytes by hand (docs/reference/ardrone.md 2, 4).
"""

import itertools
import math
import struct
from typing import Any

import pytest

from groundstation.errors import GroundStationError
from sim_bridge.devices.ardrone import ArDroneEmulator

ONE, HALF, MINUS_HALF, MINUS_ONE = 1065353216, 1056964608, -1090519040, -1082130432
TAKE_OFF, LAND, EMERGENCY = 290718208, 290717696, 290717952
FLY, START, BOOTSTRAP, VBAT_LOW = 1 << 0, 1 << 5, 1 << 11, 1 << 15
COM_WATCHDOG, EMERGENCY_BIT = 1 << 30, 1 << 31


def test_take_off_reports_the_phases(bench: Any) -> None:
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
def test_ref_is_latched_and_its_base_bits_do_not_matter(bench: Any, bits: int) -> None:
    bench.connect()
    bench.say(f"REF,{bits}")
    bench.keep(6.0)
    assert bench.major == 4
    assert bench.demo()[5] > 500


def test_land_and_start_again(bench: Any) -> None:
    bench.fly()
    bench.keep(5.0, f"REF,{LAND}")
    assert bench.body.on_ground
    bench.keep(5.0, "COMWDG")
    assert bench.body.on_ground
    bench.keep(5.0, f"REF,{TAKE_OFF}")
    assert not bench.body.on_ground


def test_signs_on_the_wire(bench: Any) -> None:
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


def test_yaw_jumps_at_lift_off(bench: Any) -> None:
    bench.connect()
    bench.keep(1.0, f"REF,{LAND}")
    grounded = bench.demo()[4]
    assert abs(grounded) < 2000
    bench.keep(5.0, f"REF,{TAKE_OFF}", "PCMD,0,0,0,0,0")
    assert 55_000 < abs(math.remainder(bench.demo()[4] - grounded, 360000)) < 150_000
    assert abs(bench.body.yaw) < 0.1


def test_values_beyond_one_are_clamped(bench: Any) -> None:
    bench.fly()
    bench.keep(1.5, "PCMD,1,0,-1069547520,0,0")  # -3.0
    assert bench.demo()[2] > -16000


def test_the_last_pcmd_is_held_while_the_link_lives(bench: Any) -> None:
    bench.fly()
    bench.say(f"PCMD,1,0,{MINUS_HALF},0,0")
    bench.keep(1.0, "COMWDG")
    assert math.hypot(bench.body.vx, bench.body.vy) > 0.4
    bench.tick(100)
    assert bench.body.pitch > 0.05, "half a second of silence changes nothing"


def test_silence_in_flight_hovers_then_lands(bench: Any) -> None:
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


def test_nothing_takes_off_by_itself_after_a_lost_link(bench: Any) -> None:
    bench.fly()
    bench.tick(2400)
    assert bench.body.on_ground
    bench.sequence += 1000
    bench.request()
    bench.keep(6.0, f"REF,{TAKE_OFF}")
    assert bench.body.on_ground, "a start button that was never released is no new press"


def test_a_client_that_comes_back_in_flight_finds_it_flying(bench: Any) -> None:
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


def test_emergency_toggles_on_the_rising_edge(bench: Any) -> None:
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


def test_a_low_battery_refuses_take_off_and_ends_a_flight(weak_bench: Any) -> None:
    bench = weak_bench
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


@pytest.mark.parametrize(
    "line", [b"AT*COMWDG=%d,\r", b"AT*FTRIM=%d,\r", b"AT*PMODE=%d,2\r", b"AT*MISC=%d,2,20,2000,3000\r", b"garbage%d\r"]
)
def test_odd_but_harmless_lines_keep_the_link(bench: Any, line: bytes) -> None:
    bench.connect()
    bench.tick(20)
    assert bench.state & COM_WATCHDOG
    bench.raw(line % 1000 + b"AT*REF=1001,512\r")
    bench.tick()
    assert not bench.state & COM_WATCHDOG
    assert bench.state & START


@pytest.mark.parametrize("line", [b"AT*REF=900,512\n", b"AT*REF=900,512", b"at*ref=900,512\r", b"AT*REF=900,0.5\r"])
def test_at_lines_ignored_by_the_real_codec_are_ignored(bench: Any, line: bytes) -> None:
    bench.connect()
    bench.raw(line)
    bench.tick()
    assert not bench.state & START


def test_nonfinite_motion_is_ignored(bench: Any) -> None:
    bench.fly()
    bench.keep(0.5, "PCMD,1,2143289344,2139095040,0,0")  # NaN, infinity
    assert bench.autopilot.phase.name == "HOVERING"
    assert all(map(math.isfinite, bench.demo()))


def test_time_and_height_options(bench: Any) -> None:
    bench.fly()
    packet = bench.packets[-1]
    offsets, offset = {}, 16
    for tag, size in bench.options(packet):
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


def test_a_taken_port_is_named(bench: Any) -> None:
    with pytest.raises(GroundStationError, match=rf"{bench.address}:5554 \(UDP\)"):
        ArDroneEmulator("d", bench.address, bench.world.drones["d"], bench.world.onboard["d"])


def test_faults_silence_and_deafen(bench: Any) -> None:
    bench.connect()
    bench.emulator.silent = True
    bench.say("COMWDG")
    assert bench.tick(10) == []
    bench.emulator.silent = False
    bench.emulator.deaf = True
    bench.keep(1.0)
    assert bench.state & COM_WATCHDOG
