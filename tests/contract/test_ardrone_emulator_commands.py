"""The emulator's rarer commands over real loopback UDP: animations, calibration, trims, absolute control, emergencies.

The bench (conftest.py) assembles and reads bytes by hand (docs/reference/ardrone.md 2, 4).
"""

import math
import struct
from typing import Any

import pytest

HALF, MINUS_ONE = 1056964608, -1082130432
TAKE_OFF, LAND, EMERGENCY = 290718208, 290717696, 290717952
CUTOUT, EMERGENCY_BIT, USER_EL = 1 << 22, 1 << 31, 1 << 16


@pytest.mark.parametrize(("animation", "axis", "sign"), [(19, 3, 1), (18, 3, -1), (16, 2, -1), (17, 2, 1)])
def test_flips_turn_over_and_fly_on(bench: Any, animation: int, axis: int, sign: int) -> None:
    bench.fly()
    bench.say(f"ANIM,{animation},15")
    angles = []
    for _ in range(40):
        bench.keep(0.03)
        angles.append((bench.demo()[axis], bench.major))
    assert max(abs(angle) for angle, _ in angles) > 150_000
    first = next(angle for angle, _ in angles if abs(angle) > 30_000)
    assert first * sign > 0
    assert 9 in {major for _, major in angles}, "TRANS_LOOPING"
    bench.keep(3.0, "PCMD,0,0,0,0,0")
    assert bench.major == 4 and not bench.body.on_ground


def test_animations_come_by_configuration_too(bench: Any) -> None:
    bench.fly()
    yaw = bench.body.yaw
    bench.say('CONFIG,"control:flight_anim","6,2500"')
    bench.keep(2.5)
    assert abs(math.remainder(bench.body.yaw - yaw, math.tau)) > 1.5
    bench.say("CTRL,5,0")
    for nonsense in ("6", "99,100", "x,y", "", "6,-1,4"):
        bench.keep(0.06, "COMWDG")
        bench.say(f'CONFIG,"control:flight_anim","{nonsense}"')
        bench.keep(0.06, "CTRL,5,0")
    assert not bench.body.on_ground


def test_leds_are_settings(bench: Any) -> None:
    bench.connect()
    bench.say(f"LED,3,{1073741824},5")
    bench.tick(2)
    assert bench.emulator.control.configuration.text("leds:leds_anim") == "3,1073741824,5"


def test_the_flat_trim_makes_the_floor_level(bench: Any) -> None:
    bench.connect()
    onboard = bench.world.onboard["d"]
    level = onboard._level
    assert max(map(abs, level)) > math.radians(0.2)
    bench.say("FTRIM")
    bench.tick(2)
    assert onboard._level == (0.0, 0.0)
    onboard._level = level
    bench.fly()
    bench.say("FTRIM")
    bench.tick(2)
    assert onboard._level == level, "ignored in the air"


def test_the_magnetometer_is_calibrated_by_a_turn(bench: Any) -> None:
    bench.connect()
    bench.say("CALIB,0")
    bench.keep(0.5)
    assert bench.body.on_ground, "only in flight"
    bench.fly()
    bench.say("CALIB,0")
    turned, last = 0.0, bench.body.yaw
    minors = set()
    for _ in range(160):
        bench.keep(0.03, "PCMD,0,0,0,0,0")
        turned += math.remainder(bench.body.yaw - last, math.tau)
        last = bench.body.yaw
        minors.add(bench.demo()[0] & 0xFFFF)
    assert abs(turned) == pytest.approx(math.tau, rel=0.1)
    assert 12 in minors and bench.demo()[0] == 4 << 16


def test_absolute_control_flies_by_the_controllers_heading(bench: Any) -> None:
    bench.fly()
    psi = bench.demo()[4] / 180_000  # the drone's heading as it reports it
    quarter = math.remainder(psi + 0.5, 2.0)  # the pilot faces 90 deg to the right of the drone's heading
    bits = struct.unpack("<i", struct.pack("<f", quarter))[0]
    bench.keep(1.0, f"PCMD_MAG,5,0,{MINUS_ONE},0,0,{bits},0")
    yaw = bench.body.yaw
    right = bench.body.vx * math.sin(yaw) - bench.body.vy * math.cos(yaw)
    ahead = bench.body.vx * math.cos(yaw) + bench.body.vy * math.sin(yaw)
    assert right > 0.8 and abs(ahead) < 0.4, "forward is where the pilot looks"


def test_a_combined_turn_banks(bench: Any) -> None:
    bench.fly()
    bench.say('CONFIG,"control:control_level","1"')
    bench.keep(0.1, "CTRL,5,0")
    bench.keep(1.5, f"PCMD,3,0,{MINUS_ONE},0,{HALF}")
    assert bench.demo()[0] == 3 << 16 | 4
    assert bench.body.roll > 0.05, "leans into the right turn"


def test_a_blocked_propeller_cuts_the_motors_until_it_is_free(bench: Any) -> None:
    bench.fly()
    bench.emulator.control.blocked = True
    bench.keep(0.1)
    assert bench.state & (CUTOUT | EMERGENCY_BIT) == CUTOUT | EMERGENCY_BIT
    assert not bench.state & USER_EL
    bench.keep(1.5, f"REF,{LAND}")
    bench.keep(0.1, f"REF,{EMERGENCY}")
    assert bench.state & EMERGENCY_BIT, "the cause is still there"
    bench.emulator.control.blocked = False
    bench.keep(0.1, f"REF,{LAND}")
    bench.keep(0.1, f"REF,{EMERGENCY}")
    assert not bench.state & (EMERGENCY_BIT | CUTOUT)
    bench.keep(0.1, f"REF,{LAND}")
    bench.keep(5.0, f"REF,{TAKE_OFF}")
    assert not bench.body.on_ground
