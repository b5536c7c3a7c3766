"""The take-off of a Tello: its height by two words, its answers, and orders that are repeated or not."""

import dataclasses
import time
from contextlib import suppress

import pytest

from drivers.tello.driver import Heard
from drivers.tello.wire.text import State
from drivers.watchdog_types import Action, DriverMode, WatchdogDecision
from groundstation.bus.messages import FlightState

STATE = State(-3, 2, -120, (5, -4, 1), 71, 50, 82, 14, (17.0, -4.0, -956.0))


STANDING = dataclasses.replace(STATE, tof=10, height=0, time=0, velocity=(0, 0, 0))
MS = 1_000_000


class Order:
    """A TAKE OFF over a manual clock: what the driver says in each turn of 50 ms, and what it makes of the answers."""

    def __init__(self, flight) -> None:
        self._flight, self.tello, self.now_ns = flight, flight.tello, 1_000_000 * MS
        self.tello._ready = True
        self.action = Action.TAKE_OFF

    def turn(self, seconds: float, state: State = STANDING) -> list[bytes]:
        """Return what the vehicle is told while it reports a state."""
        told = list[bytes]()
        for _ in range(round(seconds / 0.05)):
            self.now_ns += 50 * MS
            self.tello.heard = self.tello.heard.next(self.now_ns, state)
            self.tello.view(self.now_ns)
            self.tello.apply(self.now_ns, WatchdogDecision(DriverMode.TAKING_OFF, self.action))
            self._flight.heard.setblocking(False)
            with suppress(BlockingIOError):
                while True:
                    told.append(self._flight.heard.recv(64))
        return told

    def answer(self, words: bytes) -> None:
        """Let an answer come."""
        self.tello._hear_answer(self.now_ns, words)

    def state(self) -> FlightState:
        return self.tello.view(self.now_ns).flight_state


@pytest.fixture
def order(flight) -> Order:
    return Order(flight)


@pytest.mark.parametrize(("tof", "height"), [(70, 30), (70, 40), (45, 10), (6553, 30), (6553, 60)])
def test_a_take_off_succeeds_though_its_height_word_is_coarse_and_low(order, tof, height):
    """Real ones report `h` in steps of 10 cm, up to 35 cm below `tof`."""
    order.turn(0.1)
    low = dataclasses.replace(STATE, tof=tof, height=height, velocity=(0, 0, -5))
    order.turn(0.1, low)
    assert order.state() is FlightState.TAKING_OFF
    order.answer(b"ok")
    assert order.state() is FlightState.FLYING


def test_a_late_answer_to_another_word_ends_no_take_off_on_the_floor(order):
    """A keep-alive was answered late: it counts neither then, nor when the vehicle has risen."""
    order.turn(0.5)
    order.answer(b"ok")
    runs = dataclasses.replace(STANDING, time=1)
    order.turn(0.1, runs)
    assert order.state() is FlightState.TAKING_OFF
    order.turn(0.1, dataclasses.replace(STATE, tof=60, velocity=(0, 0, -5)))
    assert order.state() is FlightState.TAKING_OFF, "risen, but not answered"
    order.answer(b"ok")
    assert order.state() is FlightState.FLYING


def test_only_an_order_without_answer_is_repeated(order):
    assert order.turn(9.0).count(b"takeoff") == 3
    order.answer(b"error Motor stop")
    assert order.turn(9.0).count(b"takeoff") == 0


def test_a_refusal_is_told_until_the_next_order(order):
    assert order.turn(0.5).count(b"takeoff") == 1 and order.tello.view(order.now_ns).refuses == ""
    order.answer(b"error Motor stop\r\n")
    order.turn(0.1)
    assert order.tello.view(order.now_ns).refuses == "error motor stop"
    order.action = Action.LAND
    order.turn(1.0)
    order.action = Action.IDLE
    order.answer(b"error Not joystick")
    order.turn(5.0)
    order.action = Action.TAKE_OFF
    assert order.turn(1.5).count(b"takeoff") == 1 and order.tello.view(order.now_ns).refuses == ""


def test_a_late_refusal_of_an_earlier_landing_refuses_no_take_off(order):
    """`takeoff` waits for the answers to what was said before, a second at most."""
    order.action = Action.LAND
    assert b"land" in order.turn(0.1)
    order.action = Action.TAKE_OFF
    assert b"takeoff" not in order.turn(0.5)
    order.answer(b"ok")
    order.answer(b"error")
    assert order.turn(0.2).count(b"takeoff") == 1
    assert order.tello.view(order.now_ns).refuses == ""


def test_a_silent_line_delays_a_take_off_by_a_second(order):
    order.action = Action.IDLE
    order.turn(0.05)
    order.action = Action.TAKE_OFF
    assert b"takeoff" not in order.turn(0.9) and b"takeoff" in order.turn(0.2)


def test_an_answer_that_was_lost_long_ago_delays_no_take_off(order):
    order.action = Action.IDLE
    lost = order.turn(0.05)
    for _ in range(50):
        for _ in order.turn(0.05):
            order.answer(b"ok")
    order.action = Action.TAKE_OFF
    assert lost and b"takeoff" in order.turn(0.1)


def test_a_take_off_whose_height_word_stays_low_ends_when_the_climb_does(order):
    """Without an echo 20 cm may be 55: it is level for 2 s, and is landed for neither that word nor a lost answer."""
    low = dataclasses.replace(STATE, tof=6553, height=20, velocity=(0, 0, 1))
    order.turn(0.1)
    said = [order.state() for _ in range(50) if order.turn(0.05, low)]
    assert said == [FlightState.TAKING_OFF] * 40 + [FlightState.FLYING] * 10


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
    for _ in range(2):
        flight.tello._hear_answer(time.monotonic_ns(), b"ok")
    assert told(Action.TAKE_OFF) == b"takeoff"
    assert told(Action.IDLE) == b"land"


def test_the_answer_to_a_refused_command_is_reported(order):
    order.turn(0.1)
    order.answer(b"error Motor stop\r\n")
    assert order.tello.health(order.now_ns).detail == "it answers 'error motor stop' when told to take off"
    order.action = Action.HOVER
    order.turn(0.05)
    assert order.tello.health(order.now_ns).detail == ""
