"""A robot that obeys is led back into the fence, on HOLD too, before its driver takes it for one that stays outside."""

import math
from collections import deque
from dataclasses import replace

import numpy as np
import pytest

from drivers.fence import FenceWatch
from drivers.way_back import WayBack
from groundstation.bus.messages import EntityEstimate, FlightState, Header, VehicleStatus
from groundstation.control.drift import DriftWatch
from groundstation.control.flight_mode import FlightMode
from groundstation.control.hovering import Hovering
from groundstation.control.output_limiter import limit_setpoint
from groundstation.control.parameters import SafetyParameters
from groundstation.control.setpoints import Setpoint
from groundstation.control.walls import held_off, walls_around
from groundstation.estimation.belief import JointBelief
from groundstation.estimation.layout import ROBOT_CORE, EntityKind, StateLayout
from groundstation.planning.parameters import MotionLimits

S, TICK_S, LAG_S = 1_000_000_000, 0.02, 0.4
SAFETY = SafetyParameters(fence=((-3.0, 3.0), (-3.0, 3.0), (0.3, 2.6)))
MIDDLE, STD_M = (0.0, 0.0, 1.2), 0.02
LAYOUT = StateLayout().with_entity("a", EntityKind.ROBOT, ROBOT_CORE)
STILL, OUTWARDS = 0.0, 0.3


class Flight:
    """A robot with a lag, 0.1 s from the limiter to it, at a place [m; world], heading along x."""

    def __init__(self, place, mode, outwards_m_s=STILL, limits=None, drift=(0.0, 0.0, 0.0)):
        self.safety = SAFETY if limits is None else replace(SAFETY, limits={"a": limits})
        self.place, self.velocity, self.now_ns = np.array(place), np.zeros(3), 5 * S
        self.drift = np.array(drift)
        self.hovering, self.watch = Hovering((), self.safety), DriftWatch()
        if mode != "TRACK":
            status = VehicleStatus(header=Header(0, "here", "a", "a", 0), flight_state=FlightState.FLYING, mode=mode)
            self.hovering.take(status, self.now_ns)
        self.way_back = WayBack()
        self.tracks = mode == "TRACK"
        way = np.array(place) - MIDDLE
        self.wanted = tuple((outwards_m_s * np.sign(way)).tolist())
        told = self.safety.limits_of("a")
        self.fence = FenceWatch(SAFETY.fence, told.max_speed_m_s, told.max_climb_m_s)
        self.under_way = deque([np.zeros(3)] * 5)
        self.outside_s, self.fastest_m_s = 0.0, 0.0

    def step(self):
        self.now_ns += round(TICK_S * S)
        belief = JointBelief(np.append(self.place, 0.0), STD_M**2 * np.eye(4), LAYOUT, self.now_ns)
        wanted = {"a": Setpoint(self.wanted, 0.0, FlightMode.TRACK)}
        held = self.hovering.held(wanted, self.now_ns, belief, {"a": 0.1})["a"]
        drift = self.watch.see(self.now_ns, self.place + self.safety.reaction_s * self.velocity)
        limited = limit_setpoint(
            "a", held, belief, self.now_ns, self.hovering.within(self.safety), {"a": self.velocity}, {"a": drift}
        )
        sent = self.hovering.sent({"a": limited}, {"a": 0.1})["a"]
        told = sent.setpoint.velocity_m_s
        if not self.tracks:
            told = self.way_back.step(self.now_ns, told if sent.holds else None) or (0.0, 0.0, 0.0)
        velocity = np.array(told)
        self.watch.note_command(velocity)
        self.under_way.append(velocity)
        self.velocity = self.velocity + (self.under_way.popleft() - self.velocity) * TICK_S / LAG_S
        self.place = self.place + (self.velocity + self.drift) * TICK_S
        self.fastest_m_s = max(self.fastest_m_s, float(np.abs(self.velocity).max()))
        self._judge()

    def _judge(self):
        covariance = tuple((STD_M**2 * np.eye(4)).ravel().tolist())
        moves = tuple((self.velocity + self.drift).tolist())
        self.fence.hear(
            self.now_ns, EntityEstimate("a", "robot", (*self.place.tolist(), 0.0), covariance, moves, True, 0.0)
        )
        out = self.fence.outside(self.now_ns, False)
        self.outside_s = self.outside_s + TICK_S if out else max(0.0, self.outside_s - 0.2 * TICK_S)

    def worst_outside_s(self, seconds):
        """Fly on; return for how long it counted as outside at most, as its driver adds that up [s]."""
        worst_s = 0.0
        for _ in range(round(seconds / TICK_S)):
            self.step()
            worst_s = max(worst_s, self.outside_s)
        return worst_s

    @property
    def beyond_m(self):
        return max(
            max(low - at, at - high) if axis < 2 else at - high
            for axis, (at, (low, high)) in enumerate(zip(self.place, SAFETY.fence, strict=True))
        )


_PLACES = {
    "east": (3.0, 0.0, 1.2), "south": (0.0, -3.0, 1.2), "above": (0.0, 0.0, 2.6), "corner": (3.0, -3.0, 1.2),
    "edge": (-3.0, 0.0, 2.6),
}  # fmt: skip


def beyond(where, by_m):
    return tuple(
        at + by_m * np.sign(at - mid) if at != mid else at for at, mid in zip(_PLACES[where], MIDDLE, strict=True)
    )


@pytest.mark.parametrize("by_m", [0.2, 0.4])
@pytest.mark.parametrize("where", _PLACES)
@pytest.mark.parametrize(
    ("mode", "outwards_m_s"), [("HOLD", STILL), ("HOVER", STILL), ("TRACK", STILL), ("TRACK", OUTWARDS)]
)
def test_one_that_was_blown_out_is_led_back(mode, outwards_m_s, where, by_m):
    flight = Flight(beyond(where, by_m), mode, outwards_m_s)
    assert flight.worst_outside_s(4.0) < 1.0
    assert flight.beyond_m < 0.0 and flight.fastest_m_s < 0.21
    assert flight.worst_outside_s(10.0) < 1.0 and -0.35 < flight.beyond_m < -0.1


@pytest.mark.parametrize("mode", ["HOLD", "TRACK"])
def test_a_drift_outwards_does_not_keep_it_outside(mode):
    flight = Flight(beyond("east", 0.3), mode, drift=(0.05, 0.0, 0.0))
    assert flight.worst_outside_s(5.0) < 1.0
    assert flight.beyond_m < 0.0


@pytest.mark.parametrize("where", ["east", "above"])
def test_one_that_may_fly_only_slowly_is_led_back_as_fast_as_it_may(where):
    flight = Flight(beyond(where, 0.2), "HOLD", limits=MotionLimits(max_speed_m_s=0.08, max_climb_m_s=0.06))
    assert flight.worst_outside_s(6.0) < 1.0
    assert flight.beyond_m < 0.0 and flight.fastest_m_s <= 0.08 + 1e-6


def limited(place, wanted=(0.0, 0.0, 0.0), drift=(0.0, 0.0, 0.0), safety=SAFETY):
    belief = JointBelief(np.append(np.array(place), 0.0), STD_M**2 * np.eye(4), LAYOUT, 0)
    still = {"a": np.zeros(3)}
    drifts = None if drift is None else {"a": np.array(drift)}
    return limit_setpoint("a", Setpoint(wanted, 0.0, FlightMode.TRACK), belief, 0, safety, still, drifts)


@pytest.mark.parametrize(("x", "asked_m_s"), [(2.99, 0.05), (3.0, 0.05), (3.04, 0.11), (3.1, 0.2), (3.9, 0.2)])
def test_only_one_beyond_the_fence_itself_is_led_back(x, asked_m_s):
    for sign in (1.0, -1.0):
        velocity = limited((sign * x, 0.0, 1.2)).setpoint.velocity_m_s
        assert velocity == pytest.approx((-sign * asked_m_s, 0.0, 0.0), abs=1e-6)


def test_its_drift_is_countered_beside_that_and_the_plan_may_be_faster():
    assert limited((3.2, 0.0, 1.2), drift=(0.1, 0.0, 0.0)).setpoint.velocity_m_s[0] == pytest.approx(-0.3)
    assert limited((3.2, 0.0, 1.2), drift=(0.5, 0.0, 0.0)).setpoint.velocity_m_s[0] == pytest.approx(-0.35)
    assert limited((3.2, 0.0, 1.2), (-0.5, 0.1, 0.0)).setpoint.velocity_m_s == pytest.approx((-0.5, 0.1, 0.0))
    assert limited((3.2, 0.0, 1.2), drift=None).setpoint.velocity_m_s == (0.0, 0.0, 0.0)


def test_one_below_the_fence_is_not_lifted():
    """Every flight begins and ends there."""
    assert limited((0.0, 0.0, 0.0)).setpoint.velocity_m_s == pytest.approx((0.0, 0.0, 0.05))


def test_nobody_is_led_back_through_another():
    """One that stands in its way is kept away from all the same."""
    layout = LAYOUT.with_entity("b", EntityKind.ROBOT, ROBOT_CORE)
    mean = np.array((3.3, 0.0, 1.2, 0.0, 2.8, 0.0, 1.2, 0.0))
    belief = JointBelief(mean, STD_M**2 * np.eye(8), layout, 0)
    still = {"a": np.zeros(3), "b": np.zeros(3)}
    wanted = Setpoint((0.0, 0.0, 0.0), 0.0, FlightMode.TRACK)
    assert limit_setpoint("a", wanted, belief, 0, SAFETY, still, still).setpoint.velocity_m_s[0] > -1e-6
    assert limit_setpoint("b", wanted, belief, 0, SAFETY, still, still).setpoint.velocity_m_s[0] < -0.04


def test_a_hovering_robot_chooses_its_place_inside():
    for where in ("east", "above"):
        flight = Flight(beyond(where, 0.05), "HOLD")
        flight.worst_outside_s(20.0)
        kept_m = flight.safety.margin_m
        assert flight.beyond_m < -kept_m + 0.02
        assert math.hypot(*flight.velocity) < 0.06


def test_no_wall_loses_by_the_way_back():
    """Not even where walls are in conflict: others near it, drifts, and the corner of a low room."""
    layout = LAYOUT.with_entity("b", EntityKind.ROBOT, ROBOT_CORE).with_entity("c", EntityKind.ROBOT, ROBOT_CORE)
    low = replace(SAFETY, fence=(*SAFETY.fence[:2], (0.3, 1.6)))
    still, rng, led = dict.fromkeys("abc", np.zeros(3)), np.random.default_rng(7), 0
    for _ in range(2000):
        place = np.array((3.0, 3.0, 1.0)) + rng.uniform((0.0, -0.5, -0.5), (0.5, 0.5, 1.6))
        others = [place + rng.uniform(-0.8, 0.8, 3) for _ in range(2)]
        mean = np.concatenate([np.append(at, 0.0) for at in (place, *others)])
        belief = JointBelief(mean, rng.uniform(0.02, 0.3) ** 2 * np.eye(12), layout, 0)
        wanted = Setpoint(tuple(rng.uniform(-0.3, 0.3, 3).tolist()), 0.0, FlightMode.TRACK)
        drift = rng.uniform(-0.2, 0.2, 3)
        walls = [held_off(wall, tuple(drift.tolist()), low) for wall in walls_around("a", belief, low, still, {})]
        excesses = []
        for safety in (replace(low, return_m_s=0.0), low):
            told = limit_setpoint("a", wanted, belief, 0, safety, still, {"a": drift}).setpoint.velocity_m_s
            excesses.append(np.array([np.dot(wall.normal, told) - wall.most for wall in walls]))
        without, led_back = excesses
        assert np.all(led_back <= np.maximum(0.0, without) + 1e-6)
        led += not np.allclose(led_back, without)
    assert led > 300
