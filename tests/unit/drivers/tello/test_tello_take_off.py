"""The take-off of a Tello: its height by two words, its answers, and orders that are repeated or not."""

import dataclasses
import time

import pytest

from drivers.tello.driver import Heard
from drivers.tello.wire.text import State
from drivers.watchdog_types import Action, DriverMode, WatchdogDecision
from groundstation.bus.messages import FlightState

STATE = State(-3, 2, -120, (5, -4, 1), 71, 50, 82, 14, (17.0, -4.0, -956.0))


@pytest.mark.parametrize(("tof", "height"), [(70, 30), (70, 40), (45, 10), (6553, 30), (6553, 60)])
def test_a_take_off_succeeds_though_its_height_word_is_coarse_and_low(flight, tof, height):
    """Real ones report `h` in steps of 10 cm, up to 35 cm below `tof`."""
    low = dataclasses.replace(STATE, tof=tof, height=height)
    assert flight.told(Action.TAKE_OFF, state=low)[1] is FlightState.FLYING


def test_a_take_off_whose_height_word_stays_low_ends_when_the_climb_does(flight):
    """Without an echo 20 cm may be 55: it is level for 2 s, and is not landed because of the word."""
    low, said = dataclasses.replace(STATE, tof=6553, height=20, velocity=(0, 0, 1)), []
    flight.told(Action.TAKE_OFF, state=low)
    flight.tello.heard = Heard()
    for number in range(25):
        flight.tello.heard = flight.tello.heard.next(1 + number * 100_000_000, low)
        said.append(flight.tello._flight_state(1 + number * 100_000_000))
    assert said == [FlightState.TAKING_OFF] * 20 + [FlightState.FLYING] * 5


def test_the_floor_counts_where_tof_sees_it_whatever_h_says():
    """`h` is above the take-off: one that has landed on a table stands."""
    assert not Heard(1, 0, dataclasses.replace(STATE, tof=10, height=70)).airborne(5_000_000_000)
    assert Heard(1, 0, dataclasses.replace(STATE, tof=20, height=0)).airborne(5_000_000_000)
    assert not Heard(1, 0, dataclasses.replace(STATE, tof=6553, height=10)).airborne(5_000_000_000)


def test_the_emulator_reports_heights_as_low_and_coarse_as_real_ones(rig):
    rig.say(b"command")
    rig.say(b"takeoff", 5.0)
    state = rig.state()
    assert state.height % 10 == 0 and 20 <= state.tof - state.height <= 45


def test_a_take_off_that_is_called_off_is_followed_by_land(flight):
    """It stands still at the command, and would take off all the same."""
    standing = dataclasses.replace(STATE, tof=10, height=0, time=0)
    flight.tello.heard = Heard(1, 0, standing)

    def told(action: Action) -> bytes:
        flight.tello.apply(time.monotonic_ns(), WatchdogDecision(DriverMode.LANDED, action))
        skipped = (b"streamon", b"rc 0 0 0 0")
        return next(word for word in iter(lambda: flight.heard.recv(64), b"") if word not in skipped)

    flight.tello._ready = True
    assert told(Action.IDLE) == b"command"
    assert told(Action.TAKE_OFF) == b"takeoff"
    assert told(Action.IDLE) == b"land"


def test_the_answer_to_a_refused_command_is_reported(flight):
    flight.told(Action.TAKE_OFF, state=dataclasses.replace(STATE, height=0, tof=0, time=0))
    flight.tello._hear_answer(time.monotonic_ns(), b"error Motor stop\r\n")
    assert flight.tello.health(time.monotonic_ns()).detail == "it answers 'error motor stop' when told to take off"
    flight.told(Action.HOVER)
    assert flight.tello.health(time.monotonic_ns()).detail == ""
