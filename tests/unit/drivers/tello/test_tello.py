"""The Tello at the wire: text, signs and units, checked by flying its emulator; invalid states."""

import dataclasses
import math
import random
import time

import pytest

from drivers.tello.driver import Heard, velocity_from_state
from drivers.tello.wire.text import State, WireError, parse_state, rc
from drivers.watchdog_types import Action
from groundstation.bus.messages import FlightState, Odometry
from groundstation.vehicles import kind_named
from sim_bridge.conformance.subject import subject_of
from sim_bridge.devices.tello_text import parse_rc, state_text

STATE = State(-3, 2, -120, (5, -4, 1), 71, 50, 82, 14, (17.0, -4.0, -956.0))


def test_corrections_in_hover_are_commanded_as_velocities_in_flight(flight) -> None:
    flies, _ = flight.told(Action.FLY, (0.1, -0.15, 0.0))
    assert flight.told(Action.HOVER, back=(0.1, -0.15, 0.0))[0] == flies != flight.told(Action.HOVER)[0]


def test_one_absurd_velocity_is_not_published_and_the_next_ones_are_uncertain(flight) -> None:
    now_ns = time.monotonic_ns()
    for number in range(30):
        north = 990 if number == 20 else number % 3
        state = dataclasses.replace(
            STATE, velocity=(north, 0, 0), acceleration=(17.0, -4.0, -956.0 - number), time=number
        )
        flight.tello._hear_state(now_ns + number * 100_000_000, state_text(state))
    told = [one.message for one in flight.odometry.drain() if isinstance(one.message, Odometry)]
    assert len(told) == 29 and all(math.hypot(*one.velocity_m_s) < 1.0 for one in told)
    stds = [math.sqrt(one.velocity_covariance[0]) for one in told]
    assert max(stds[:20]) < 0.1 and stds[20:] == pytest.approx([0.5] * 9)


def test_a_state_survives_its_text():
    assert parse_state(state_text(STATE)) == STATE


def test_spaces_and_an_end_mark_around_keys_and_values_are_no_damage():
    """As real ones send it: spaces before values and keys, none or several marks at the end."""
    said = state_text(STATE).decode().strip()
    for other in (said.rstrip(";"), said + "  ", said + "\r\n\0", said.replace(";", "; "), said.replace(":", ": ")):
        assert parse_state(other.encode()) == STATE


def test_sticks_survive_their_text_and_are_cut():
    assert parse_rc(rc(-100, 7, 0, 100)) == (-100, 7, 0, 100)
    assert rc(-250, 0, 101, 3) == b"rc -100 0 100 3"
    assert parse_rc(b"rc 1 2 3") is None and parse_rc(b"rc a 0 0 0") is None and parse_rc(b"rc 0 0 0 101") is None


def test_mutated_states_are_refused_or_sane():
    draw, refused = random.Random(4), 0
    for _ in range(3000):
        data = bytearray(state_text(STATE))
        for _ in range(draw.randint(1, 6)):
            data[draw.randrange(len(data))] = draw.randrange(256)
        try:
            state = parse_state(bytes(data))
        except WireError:
            refused += 1
            continue
        assert abs(state.yaw) <= 180 and 0 <= state.battery <= 100 and all(map(math.isfinite, state.acceleration))
    assert 500 < refused < 3000


@pytest.mark.parametrize(
    ("velocity", "turn", "words"),
    [((0.3, 0.0, 0.0), 0.0, b"rc 0 30 0 0"), ((3.0, 4.0, 0.0), 0.0, b"rc -48 36 0 0"),
     ((0.0, 0.0, -2.0), 0.0, b"rc 0 0 -40 0"), ((0.0, 0.0, 0.0), 9.0, b"rc 0 0 0 -60")],
)  # fmt: skip
def test_sticks_keep_the_limits_of_the_field_and_the_direction(flight, velocity, turn, words):
    assert flight.told(Action.FLY, velocity, turn)[0] == words


def test_it_says_when_it_hovers(flight):
    still = dataclasses.replace(STATE, velocity=(0, 1, 0))
    assert flight.told(Action.HOVER, state=still) == (b"rc 0 0 0 0", FlightState.HOVERING)
    assert flight.told(Action.HOVER, state=dataclasses.replace(STATE, velocity=(6, 0, 0)))[1] is FlightState.FLYING
    assert flight.told(Action.FLY, state=still)[1] is FlightState.FLYING
    assert flight.told(Action.LAND, state=still) == (b"rc 0 0 0 0", FlightState.LANDING)
    assert flight.heard.recv(64) == b"land", "its last sticks would be kept while it lands"
    assert flight.told(Action.CUT, state=still)[0] == b"emergency"
    assert flight.heard.recv(64) == b"rc 0 0 0 0", "one that does not obey must not fly on at its last velocity"


def test_one_that_says_that_it_stands_is_told_to_land_all_the_same(flight):
    """Its report may be wrong."""
    assert flight.told(Action.LAND, state=dataclasses.replace(STATE, tof=10, height=0))[0] == b"rc 0 0 0 0"
    assert flight.heard.recv(64) == b"land"


def test_it_flies_only_after_it_was_greeted(rig):
    rig.say(b"takeoff", 1.0)
    assert not rig.body.motors_on
    assert rig.partner.recv(64).startswith(b"unknown command")


@pytest.mark.parametrize(
    ("sticks", "velocity", "turn"),
    [((0, 40, 0, 0), (0.4, 0, 0), 0), ((40, 0, 0, 0), (0, -0.4, 0), 0), ((0, 0, 30, 0), (0, 0, 0.3), 0),
     ((0, 0, 0, 30), (0, 0, 0), -0.52), ((-20, -30, 0, -30), (-0.3, 0.2, 0), 0.52)],
)  # fmt: skip
def test_signs_and_units_of_sticks_and_state_agree(rig, sticks, velocity, turn):
    rig.say(b"command")
    rig.say(b"takeoff", 4.0)
    before = rig.state()
    rig.say(rc(*sticks), 2.0)
    after = rig.state()
    assert velocity_from_state(after) == pytest.approx(velocity, abs=0.16)
    turned = -math.radians(math.remainder(after.yaw - before.yaw, 360.0))
    assert turned == pytest.approx(2.0 * turn, abs=0.15)
    assert rig.body.airframe.velocity_stabilized() == pytest.approx(velocity[:2], abs=0.16)


def test_it_lands_after_fifteen_silent_seconds(rig):
    rig.say(b"command")
    rig.say(b"takeoff", 4.0)
    rig.turn(10.0)
    assert rig.body.airborne
    rig.turn(6.0)
    assert not rig.body.airborne and not rig.body.motors_on


def test_emergency_stops_the_motors_and_hover_does_not_start_them(rig):
    stop = kind_named("tello").stop([subject_of("tello").order()])
    rig.say(b"command")
    rig.say(stop.hover, 1.0)
    assert not rig.body.motors_on
    rig.say(b"takeoff", 4.0)
    rig.say(stop.hover, 1.0)
    assert rig.body.airborne
    rig.say(b"emergency")
    assert not rig.body.motors_on


def test_one_that_stands_and_gets_no_echo_from_the_floor_does_not_count_as_airborne():
    """As in logs of several real vehicles before the first flight."""
    said = (
        b"mid:-1;x:0;y:0;z:0;mpry:0,0,0;pitch:0;roll:0;yaw:0;vgx:0;vgy:0;vgz:0;templ:59;temph:63;tof:6553;h:0;"
        b"bat:91;baro:60.84;time:0;agx:-3.00;agy:14.00;agz:-1008.00;\r\n"
    )
    assert not Heard(1, 0, parse_state(said)).airborne(2_000_000_000)
    assert Heard(1, 0, parse_state(said.replace(b"h:0", b"h:90"))).airborne(2_000_000_000)


def test_a_vehicle_whose_motors_run_on_the_floor_counts_as_airborne():
    low = State(0, 0, 0, (0, 0, 0), 10, 0, 80, 3, (0.0, 0.0, -1000.0))
    assert Heard(1, 1_000_000_000, low).airborne(2_000_000_000)
    assert not Heard(1, 1_000_000_000, low).airborne(3_000_000_000)
