"""RESUME after a pilot's stop: the vehicle is claimed once, as it accepts, and left to a pilot who returns."""

import random

import pytest

from drivers.mavlink.commands import Orders
from drivers.mavlink.mode_watch import KEY
from drivers.mavlink.requests import Requests
from drivers.mavlink.settings import VehicleSettings
from drivers.mavlink.wire.flight import CommandAckMessage, CommandLong
from drivers.mavlink.wire.names import (
    ARMED,
    Flavour,
    Landed,
    MavCmd,
    MavResult,
    Px4Auto,
    Px4Main,
    guided_mode,
    px4_mode,
)
from drivers.watchdog_types import Action, DriverMode, WatchdogDecision

MS = 1_000_000
GUIDED = guided_mode(Flavour.PX4)
POSITION, LAND = px4_mode(Px4Main.POSITION), px4_mode(Px4Main.AUTO, Px4Auto.LAND)
LINK_MS, TURN_MS, LOSS_MS = 25, 25, 500
STOP_MS, RESUME_MS = 2_000, 6_000


class Flown:
    """A PX4 in the air, as its commander judges: OFFBOARD needs fresh setpoints; heartbeats tell of it once a second.

    beats_ms: when in each second they are sent; kept: whether one arrives.
    """

    def __init__(self, beats_ms=0, kept=lambda: True):
        vehicle = VehicleSettings(name="v", system_id=1, flavour="px4")
        self.requests = Requests(1)
        self.orders = Orders(vehicle, Flavour.PX4, self.requests)
        self.mode = self.told = GUIDED
        self.ms, self.entered_ns, self.action = 0, 1, Action.FLY
        self.asked, self._setpoint_ms = [], 0
        self._beats_ms, self._kept, self._up, self._down = beats_ms, kept, [], []
        self.refuses_until_ms = 0

    def until(self, end_ms):
        while self.ms < end_ms:
            self.turn()

    def turn(self):
        self.ms += TURN_MS
        now_ns = self.ms * MS
        mode = DriverMode.TRACK if self.action is Action.FLY else DriverMode.HOLD
        decision = WatchdogDecision(mode, self.action, (0.3, 0.0, 0.0), setpoint_ns=now_ns, entered_ns=self.entered_ns)
        setpoint = self.orders.step(now_ns, decision, ARMED, self.told, Landed.IN_AIR, 1.0)
        sent = [*self.requests.due(now_ns), *([] if setpoint is None else [setpoint])]
        self._up += [(self.ms + LINK_MS, message) for message in sent]
        for message in self._arrived(self._up):
            self._obey(message)
        if self.mode == GUIDED and self.ms - self._setpoint_ms > LOSS_MS:
            self.mode = LAND
        if self.ms % 1000 == self._beats_ms and self._kept():
            self._down.append((self.ms + LINK_MS, self.mode))
        for message in self._arrived(self._down):
            if isinstance(message, int):
                self.told = message
            else:
                self.requests.answer(now_ns, message)

    def _arrived(self, line):
        here = [message for at_ms, message in line if at_ms <= self.ms]
        line[:] = [one for one in line if one[0] > self.ms]
        return here

    def _obey(self, message):
        if not isinstance(message, CommandLong):
            self._setpoint_ms = self.ms
            return
        assert message.command == MavCmd.DO_SET_MODE
        self.asked.append(self.ms)
        allowed = self.ms - self._setpoint_ms < LOSS_MS and self.ms >= self.refuses_until_ms
        self.mode = GUIDED if allowed else self.mode
        result = MavResult.ACCEPTED if allowed else MavResult.TEMPORARILY_REJECTED
        for delay_ms, one in ((0, MavResult.ACCEPTED), (TURN_MS, result)):  # its receiver's, and its commander's
            self._down.append((self.ms + LINK_MS + delay_ms, CommandAckMessage(message.command, one, 0, 0, 255, 190)))

    def stopped_and_resumed(self):
        self.until(STOP_MS)
        self.mode = POSITION
        self.until(RESUME_MS)
        assert self.orders.yields
        self.orders.events.clear()
        self.entered_ns = self.ms * MS
        return self


@pytest.mark.parametrize("beats_ms", range(0, 1000, 100))
def test_a_px4_is_regained_whenever_its_heartbeat_comes(beats_ms):
    flown = Flown(beats_ms).stopped_and_resumed()
    flown.until(RESUME_MS + 6_000)
    assert flown.mode == GUIDED and not flown.orders.yields and not flown.orders.events
    assert not flown.requests.failures, "it was asked only once it would accept"
    assert len(flown.asked) == 1


def test_a_lost_heartbeat_does_not_make_us_leave_a_vehicle_that_has_accepted():
    chance = random.Random(1)
    for beats_ms in range(0, 1000, 25):
        flown = Flown(beats_ms).stopped_and_resumed()
        lost = [chance.random() < 0.5, True, False]  # of three in a row at most two
        flown._kept = lambda lost=lost: not (lost and lost.pop(0))
        flown.until(RESUME_MS + 6_000)
        assert flown.mode == GUIDED and not flown.orders.yields


@pytest.mark.parametrize("after_ms", [100, 500, 1_000, 2_500])
def test_a_pilot_who_stops_it_again_is_not_asked_a_second_time(after_ms):
    """No heartbeat needs to have told of our mode before."""
    flown = Flown(900).stopped_and_resumed()
    while not flown.asked:
        flown.turn()
    flown.until(flown.ms + after_ms)
    flown.mode = POSITION
    flown.until(flown.ms + 6_000)
    assert flown.mode == POSITION and len(flown.asked) == 1
    assert flown.orders.yields.startswith("it is in POSITION")


def test_a_hold_between_the_answer_and_the_heartbeat_keeps_the_setpoints_coming():
    flown = Flown().stopped_and_resumed()
    flown._kept = lambda: False
    while KEY not in flown.requests.accepted:
        flown.turn()
    flown.action = Action.HOVER
    flown.until(flown.ms + 1_500)
    assert flown.mode == GUIDED


def test_a_vehicle_that_never_answers_is_left_after_a_while():
    flown = Flown().stopped_and_resumed()
    flown._obey = lambda message: None
    flown.until(RESUME_MS + 4_000)
    assert flown.orders.yields and flown.mode == POSITION


@pytest.mark.parametrize("beats_ms", range(0, 1000, 100))
def test_a_px4_whose_receiver_accepts_what_its_commander_refuses_is_asked_again(beats_ms):
    flown = Flown(beats_ms).stopped_and_resumed()
    flown.refuses_until_ms = RESUME_MS + 2_000  # the first request comes at 1.2 s, the second a second later
    flown.until(RESUME_MS + 8_000)
    assert len(flown.asked) == 2 and list(flown.requests.failures) == ["guided mode: temporarily rejected"]
    assert flown.mode == GUIDED and not flown.orders.yields


def test_a_px4_that_goes_on_refusing_is_left_in_its_mode_with_the_usual_bounds():
    flown = Flown().stopped_and_resumed()
    flown.refuses_until_ms = RESUME_MS + 60_000
    flown.until(RESUME_MS + 3_500)
    assert flown.orders.yields.startswith("it is in POSITION")
    flown.until(RESUME_MS + 20_000)
    assert len(flown.asked) == 2 and flown.mode == POSITION
