"""Hovering drones hold their place with little motion, and are not moved while their position is in doubt."""

import math
from dataclasses import replace

import numpy as np
import pytest

from groundstation.bus.messages import FlightState, Header, VehicleStatus
from groundstation.control.flight_mode import FlightMode
from groundstation.control.hovering import Hovering
from groundstation.control.output_limiter import Limited, limit_setpoint
from groundstation.control.parameters import SafetyParameters
from groundstation.control.setpoints import Setpoint
from groundstation.estimation.belief import JointBelief
from groundstation.estimation.layout import ROBOT_CORE, EntityKind, StateLayout

S = 1_000_000_000
TICK_S = 0.02
PLANNED = Setpoint((0.5, 0.1, 0.3), 0.4, FlightMode.TRACK)
SAFETY = SafetyParameters(fence=((-3.0, 3.0), (-3.0, 3.0), (0.3, 2.6)))
LAYOUT = StateLayout().with_entity("a", EntityKind.ROBOT, ROBOT_CORE)


def status(mode="HOVER", failsafe="", name="a"):
    return VehicleStatus(
        header=Header(0, "here", name, name, 0), flight_state=FlightState.FLYING, mode=mode, failsafe=failsafe
    )


def belief(x, y, yaw=0.0, z=1.0):
    return JointBelief(np.array((x, y, z, yaw)), 1e-4 * np.eye(4), LAYOUT, 0)


class Flight:
    """A robot without lag that drifts, its estimate, and its setpoints."""

    def __init__(self, mode="HOVER", drift=(0.0, 0.0), yaw=0.7):
        self.hovering, self.now_ns, self.drift, self.yaw = Hovering(), 5 * S, drift, yaw
        self.place, self.seen_s, self.ways = np.zeros(2), {"a": 0.1}, []
        self.height_m, self.climbs = 1.0, []
        self.hovering.take(status(mode), self.now_ns)

    def step(self):
        self.now_ns += round(TICK_S * S)
        believed = belief(self.place[0], self.place[1], self.yaw, self.height_m)
        held = self.hovering.held({"a": PLANNED}, self.now_ns, believed, self.seen_s)
        sent = self.hovering.sent({"a": Limited(held["a"])}, self.seen_s)["a"]
        forward, left, up = sent.setpoint.velocity_m_s
        assert sent.setpoint.yaw_rate_rad_s == 0.0
        self.height_m += TICK_S * up
        self.climbs.append(up)
        c, s = math.cos(self.yaw), math.sin(self.yaw)
        velocity = np.array((c * forward - s * left, s * forward + c * left)) if sent.holds else np.zeros(2)
        self.place = self.place + TICK_S * (velocity + self.drift)
        self.ways.append(float(np.hypot(*velocity)))
        return sent

    def run(self, seconds):
        return [self.step() for _ in range(round(seconds / TICK_S))]


@pytest.mark.parametrize("mode", ["HOVER", "HOLD"])
def test_a_drift_does_not_carry_it_off(mode):
    flight = Flight(mode, drift=(0.03, -0.04))
    flight.run(2.0)
    settled = flight.place
    flight.run(240.0)
    assert math.dist(settled, flight.place) < 0.2 and not any(flight.climbs)
    assert max(flight.ways) <= 0.2 + 1e-9


def test_a_drone_near_its_hover_place_is_not_moved():
    flight = Flight()
    flight.run(2.0)
    flight.place = np.array((0.06, 0.07))
    assert not any(sent.holds for sent in flight.run(5.0))
    flight.place = np.array((0.08, 0.07))
    assert flight.step().holds
    flight.run(10.0)
    assert np.hypot(*flight.place) <= 0.03


@pytest.mark.parametrize(("off_m", "speed_m_s"), [(0.15, 0.12), (0.25, 0.2), (0.45, 0.2)])
def test_it_is_brought_back_by_eight_tenths_of_the_way_a_second_at_two_decimetres_at_most(off_m, speed_m_s):
    flight = Flight()
    flight.run(2.0)
    flight.place = np.array((0.0, off_m))
    flight.step()
    assert flight.ways[-1] == pytest.approx(speed_m_s)


def test_correction_ends_within_three_centimetres_of_the_hover_place():
    flight = Flight()
    flight.run(2.0)
    flight.place = np.array((0.2, 0.0))
    flight.run(10.0)
    assert np.hypot(*flight.place) == pytest.approx(0.03, abs=0.005)


def test_it_is_not_moved_until_it_has_come_to_rest():
    flight = Flight(drift=(0.5, 0.0))  # it brakes
    assert not any(sent.holds for sent in flight.run(1.4))
    flight.drift = (0.0, 0.0)
    stops = flight.place
    flight.run(10.0)
    assert math.dist(stops, flight.place) < 0.01


def test_a_belief_that_jumps_moves_nobody_far():
    flight = Flight()
    flight.run(2.0)
    flight.place = np.array((0.8, 0.0))
    assert not any(sent.holds for sent in flight.run(10.0))
    flight.place = np.array((0.4, 0.0))
    flight.run(10.0)
    assert flight.place[0] == pytest.approx(0.8, abs=0.04)


@pytest.mark.parametrize("seen_s", [{}, {"a": 1.1}])
def test_a_drone_with_a_doubtful_position_is_not_moved(seen_s):
    flight = Flight(drift=(0.05, 0.0))
    flight.run(3.0)
    flight.seen_s = seen_s
    assert not any(sent.holds for sent in flight.run(10.0))
    assert flight.place[0] == pytest.approx(13.0 * 0.05, abs=0.05)


def test_a_further_order_holds_the_place_of_that_moment():
    flight = Flight("HOVER")
    flight.run(2.0)
    flight.place = np.array((0.3, 0.0))
    flight.hovering.take(status("HOVER"), flight.now_ns)  # the same command, repeated
    assert flight.step().holds
    flight.hovering.take(status("HOLD"), flight.now_ns)
    there = flight.place
    flight.run(10.0)
    assert math.dist(there, flight.place) < 0.01


@pytest.mark.parametrize("failsafe", ["driver_stood", "sensors_wrong"])
def test_a_drone_that_waits_for_resume_after_a_pause_is_held(failsafe):
    flight = Flight(drift=(0.05, 0.0))
    flight.hovering.take(status("HOVER", failsafe=failsafe), flight.now_ns)
    assert any(sent.holds for sent in flight.run(10.0))


@pytest.mark.parametrize("other", [status("TRACK"), status("LANDING"), status("HOVER", failsafe="strays")])
def test_drones_in_tracking_landing_or_failsafe_are_not_held(other):
    flight = Flight()
    flight.hovering.take(other, flight.now_ns)
    assert flight.hovering.held({"a": PLANNED}, flight.now_ns, belief(1.0, 1.0), {"a": 0.0}) == {"a": PLANNED}
    limited = Limited(PLANNED)
    assert flight.hovering.sent({"a": limited}, {"a": 0.0}) == {"a": limited}


@pytest.mark.parametrize("off_m", [0.8, -0.8, 0.25])
def test_a_drone_off_its_hover_height_is_brought_back(off_m):
    """An object under a drone's ultrasound raises it by its height; after the object it sinks as much."""
    flight = Flight()
    flight.run(2.0)
    flight.height_m += off_m
    flight.run(10.0)
    assert flight.height_m == pytest.approx(1.0, abs=0.06)
    assert max(map(abs, flight.climbs)) <= 0.2 + 1e-9 and not any(flight.ways)


def test_a_drone_near_its_hover_height_is_not_moved():
    flight = Flight()
    flight.run(2.0)
    flight.height_m = 1.19
    assert not any(sent.holds for sent in flight.run(5.0))


def test_a_height_that_jumps_moves_nobody():
    flight = Flight()
    flight.run(2.0)
    flight.height_m = 2.1
    assert not any(sent.holds for sent in flight.run(5.0))


def test_the_fence_pushes_down_who_hovers():
    pushed = Limited(replace(PLANNED, velocity_m_s=(0.0, 0.0, -0.1)), ("fence",))
    sent = Flight().hovering.sent({"a": pushed}, {"a": 0.1})["a"]
    assert sent.holds and sent.setpoint.velocity_m_s == (0.0, 0.0, -0.1)


def test_velocities_of_the_limiter_are_sent_whole_while_the_drone_is_seen():
    flight = Flight()
    pushed = Limited(replace(PLANNED, velocity_m_s=(0.0, -0.05, 0.02)), ("separation",))
    sent = flight.hovering.sent({"a": pushed}, {"a": 0.1})["a"]
    assert sent.holds and sent.setpoint.velocity_m_s == (0.0, -0.05, 0.02) and sent.limited_by == ("separation",)
    assert not flight.hovering.sent({"a": pushed}, {})["a"].holds


def test_a_drone_that_holds_its_height_by_our_estimate_is_brought_back_across_only():
    hovering = Hovering(level=("a",))
    hovering.take(status(), 0)
    hovering.held({"a": PLANNED}, 2 * S, belief(0.0, 0.0), {"a": 0.1})
    back = hovering.held({"a": PLANNED}, 3 * S, belief(0.2, 0.0, z=1.5), {"a": 0.1})["a"]
    assert back.velocity_m_s == pytest.approx((-0.16, 0.0, 0.0))


def test_only_a_hovering_robot_is_limited_to_its_way_back():
    hovering = Hovering(level=("b",))
    for name in ("a", "b"):
        hovering.take(status(name=name), 0)
    safety = hovering.within(SAFETY)
    told = {name: safety.limits_of(name) for name in ("a", "b", "c")}
    assert {name: (one.max_speed_m_s, one.max_climb_m_s) for name, one in told.items()} == {
        "a": (0.2, 0.2), "b": (0.2, 0.0), "c": (0.6, 0.4),
    }  # fmt: skip
    brought_back = replace(PLANNED, velocity_m_s=(0.12, 0.16 + 1e-15, 0.0), yaw_rate_rad_s=0.0)
    assert limit_setpoint("a", brought_back, belief(0.0, 0.0), 0, safety).limited_by == ()


@pytest.mark.parametrize("level", [(), ("a",), ("a", "b")])
@pytest.mark.parametrize("aside_m", [0.05, 0.3])
def test_two_that_hover_one_above_the_other_too_near_are_moved_apart(level, aside_m):
    """What is sent satisfies the limiter's walls, also of a robot that obeys only the horizontal part."""
    layout = LAYOUT.with_entity("b", EntityKind.ROBOT, ROBOT_CORE)
    hovering, now_ns, seen_s = Hovering(level=level), 0, {"a": 0.1, "b": 0.1}
    for name in ("a", "b"):
        hovering.take(status(name=name), 0)
    places, still = (
        {"a": np.array((0.0, 0.0, 1.8)), "b": np.array((aside_m, 0.0, 1.25))},
        dict.fromkeys("ab", np.zeros(3)),
    )
    for _ in range(600):
        now_ns += S // 20
        at = JointBelief(np.hstack([(*place, 0.0) for place in places.values()]), 9e-4 * np.eye(8), layout, now_ns)
        safety, held = hovering.within(SAFETY), hovering.held(dict.fromkeys("ab", PLANNED), now_ns, at, seen_s)
        limited = {n: limit_setpoint(n, held[n], at, now_ns, safety, still, still) for n in "ab"}
        for name, told in hovering.sent(limited, seen_s).items():
            forward, left, up = told.setpoint.velocity_m_s
            places[name] += (forward / 20, left / 20, 0.0 if name in level else up / 20)
    assert np.linalg.norm(places["a"] - places["b"]) > SAFETY.min_separation_m + 0.15
