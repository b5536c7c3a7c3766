"""A vehicle's reported velocity is overruled by cameras, and used again at once when it is right."""

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from groundstation.bus.messages import (
    FlightState,
    Header,
    Message,
    Odometry,
    RelativeObservation,
    VehicleStatus,
    Verdict,
)
from groundstation.control.flight_mode import FlightMode
from groundstation.control.setpoints import Setpoint
from groundstation.control.view import Localisation
from groundstation.estimation.measurement import Correction
from groundstation.field.resolved import ResolvedField
from groundstation.tracker import tracker_from_field

MS, START, FRAME_TICKS, STD_M = 1_000_000, 7_000_000_000_000, 6, 0.015
SCALE = 1.18  # the shipped field's
COVARIANCE = tuple(np.diag([STD_M**2, STD_M**2, 9e-4, 1.2e-3]).ravel().tolist())
LIE = np.array([0.5, 0.0])
Told = Callable[[np.ndarray], np.ndarray]


def honest(velocity: np.ndarray) -> np.ndarray:
    return velocity


class Flight:
    """drone_1 flies to and fro in the ceiling camera's view; its reported velocity [m/s, true scale] is chosen."""

    def __init__(self, field: ResolvedField) -> None:
        self.tracker = tracker_from_field(field, "here", 1)
        self.now, self.ticks, self.seq = START, 0, 0
        self.place, self.velocity = np.array([-0.5, 0.3]), np.zeros(2)
        self.errors_m: list[float] = []
        self.rng = np.random.default_rng(5)
        status = VehicleStatus(header=self.header("drone_1"), flight_state=FlightState.FLYING, mode="TRACK")
        self.send(status)

    def header(self, entity: str, age_ms: int = 0) -> Header:
        self.seq += 1
        return Header(self.now - age_ms * MS, "here", entity, entity, self.seq)

    def send(self, message: Message) -> None:
        assert self.tracker.ingest(f"{type(message).__name__}/{message.header.entity}", message, self.now) is None

    def run(self, seconds: float, told: Told = honest, speed: float = 0.0, look: bool = True) -> float:
        """Fly on; returns the largest position error of the belief [m]."""
        self.errors_m = []
        for _ in range(round(seconds * 100)):
            self.now, self.ticks = self.now + 10 * MS, self.ticks + 1
            self.velocity = speed * np.array([math.cos(0.005 * self.ticks), math.sin(0.005 * self.ticks)])
            self.place = self.place + 0.01 * self.velocity
            noise = 0.02 * self.rng.standard_normal(2)
            vx, vy = ((told(self.velocity) + noise) / SCALE).tolist()
            values: Any = {"yaw_rad": 0.0, "roll_rad": 1e-9 * self.seq, "pitch_rad": 0.0, "height_m": 1.3}
            header = self.header("drone_1")
            self.send(Odometry(header=header, velocity_m_s=(vx, vy, 0.0), velocity_covariance=(0.0025,) * 9, **values))
            if look and self.ticks % FRAME_TICKS == 0:
                self.send(self.ceiling())
            self.tracker.advance(self.now)
            if "drone_1" in self.tracker.belief.layout:
                self.errors_m.append(float(np.linalg.norm(self.tracker.belief.mean_of("drone_1")[:2] - self.place)))
        return max(self.errors_m, default=math.inf)

    def ceiling(self) -> RelativeObservation:
        x, y = (self.place + STD_M * self.rng.standard_normal(2)).tolist()
        position = (x, -y, 4.2 - 1.3 - 0.08 + 0.03 * float(self.rng.standard_normal()))
        return RelativeObservation(
            header=self.header("ceiling"),
            observer="ceiling",
            subject="drone_1",
            camera="ceiling_camera",
            position_m=position,
            yaw_rad=0.035 * float(self.rng.standard_normal()),
            covariance=COVARIANCE,
        )

    @property
    def believed_velocity(self) -> np.ndarray:
        return np.array(self.tracker.filter.velocity_of("drone_1")[:2])

    @property
    def anees(self) -> float:
        belief = self.tracker.belief
        error, P = belief.mean_of("drone_1")[:2] - self.place, belief.covariance_of("drone_1")[:2, :2]
        return float(error @ np.linalg.solve(P, error)) / 2.0


@pytest.fixture
def flight(lab_field: ResolvedField) -> Flight:
    found = Flight(lab_field)
    found.run(3.0)
    return found


def test_a_velocity_that_is_half_a_metre_wrong_moves_the_belief_no_further_than_a_hand(flight: Flight) -> None:
    begun = flight.run(1.0, lambda v: v + LIE)
    lasting = flight.run(4.0, lambda v: v + LIE)
    assert begun < 0.15
    assert lasting < 0.08, "within a second the lie is known"
    assert float(np.linalg.norm(flight.believed_velocity - flight.velocity)) < 0.15


def test_the_belief_recovers_when_the_velocity_is_right_again(flight: Flight) -> None:
    flight.run(4.0, lambda v: v + LIE)
    assert flight.run(1.0) < 0.15
    flight.run(3.0)
    assert flight.run(2.0) < 0.05


@pytest.mark.parametrize("stuck", [0.0, 0.5])
def test_a_velocity_that_is_stuck_while_it_flies_is_overruled(flight: Flight, stuck: float) -> None:
    assert flight.run(6.0, lambda _: np.array([stuck, 0.0]), speed=0.5) < 0.15
    assert not [c for c in flight.tracker.take_corrections() if c.joined and c.nis is not None], "nobody is given up"


def test_after_a_lie_the_dark_is_known_to_be_darker(flight: Flight) -> None:
    flight.run(3.0, lambda v: v + LIE)
    flight.run(3.0, lambda v: v + LIE, look=False)
    assert flight.anees < 4.0, "what it says while nobody looks counts for little"


def test_a_velocity_that_was_seen_to_be_wrong_is_not_right_because_nobody_looks(flight: Flight) -> None:
    """It drifts by 3 cm/s each second, too slowly to be surprising; then the robot leaves the camera's view."""
    began = flight.ticks

    def drifting(velocity: np.ndarray) -> np.ndarray:
        return velocity + np.array([0.0003 * min(flight.ticks - began, 500), 0.0])

    assert flight.run(5.0, drifting) < 0.1
    assert flight.run(2.5, drifting, look=False) < 0.2, "0.3 m, were it believed again"
    assert flight.anees < 3.0, "11 then"
    flight.run(4.0)
    assert flight.run(2.0) < 0.05, "and believed again once it is right"


def test_an_honest_velocity_is_as_good_as_before(flight: Flight) -> None:
    flight.run(3.0, speed=0.5)
    assert flight.run(3.0, speed=0.5, look=False) < 0.15
    variance = float(flight.tracker.belief.covariance_of("drone_1")[0, 0])
    assert math.sqrt(variance) < 0.12


@pytest.mark.parametrize("limit", [{"max_velocity_error_m_s": 0.001}, {"max_known_velocity_error_m_s": 1e-6}])
def test_an_unseen_robot_with_uncertain_velocity_is_not_converged(flight: Flight, limit: dict[str, Any]) -> None:
    flight.run(2.0)
    tracker = flight.tracker
    assert tracker.converged("drone_1")
    tracker._localisation = Localisation(replace(tracker.parameters.safety, **limit))
    flight.run(0.7, look=False)
    assert not tracker.converged("drone_1")


@pytest.mark.parametrize("fed", [False, True])
def test_repeated_re_initialisation_stops_all_but_vehicles_on_our_estimate(flight: Flight, fed: bool) -> None:
    """Otherwise such a vehicle would lose its position updates: it flies off, and lands."""
    flight.run(2.0)
    tracker = flight.tracker
    control = replace(tracker.parameters.control, fed=frozenset(["drone_1"] if fed else []))
    tracker.parameters = replace(tracker.parameters, control=control)
    again = Correction("ceiling", "drone_1", Verdict.ACCEPTED, "", nis=900.0, joined=True)
    for _ in range(2):
        tracker._joinings.take(flight.now, [again])
    assert tracker.converged("drone_1") is fed


def test_an_unseen_robot_is_localised_by_a_target_that_others_locate(flight: Flight) -> None:
    """drone_1, unseen, sees a target that is located by another observer, which the ceiling camera sees."""
    tracker = flight.tracker
    tracker._localisation = Localisation(replace(tracker.parameters.safety, max_velocity_error_m_s=0.001))
    flight.run(0.7, look=False)
    assert not tracker.converged("drone_1")
    chain = [
        Correction(observer, "turtlebot", Verdict.ACCEPTED, "", latency_ms=100.0) for observer in ("ceiling", "drone_1")
    ]
    tracker._roots.advance(flight.now, chain, flying=True)
    assert tracker.converged("drone_1")
    (told,) = tracker.estimates()
    assert told.age_s == pytest.approx(0.1)


@pytest.mark.parametrize(
    ("state", "drift_m_s"),
    [
        ({"mode": "TRACK"}, -0.3),
        ({"mode": "TRACK", "braked": True}, 0.0),
        ({"mode": "HOVER", "failsafe": "strays"}, 0.0),
        ({"mode": "TAKING_OFF"}, 0.0),
        ({"mode": "HOVER"}, 0.0),
    ],
)
def test_only_commands_that_the_driver_obeys_count_in_the_drift(
    flight: Flight, monkeypatch: pytest.MonkeyPatch, state: dict[str, Any], drift_m_s: float
) -> None:
    """It stands still; what it was not told to do is no drift of it."""
    drifts: list[float] = []

    def forward(*given: Any) -> dict[str, Setpoint]:
        drifts.append(float(given[5].drifts_m_s["drone_1"][0]))
        return {"drone_1": Setpoint((0.3, 0.0, 0.0), 0.0, FlightMode.TRACK)}

    monkeypatch.setattr("groundstation.tracker.setpoints_from_plan", forward)
    flight.send(VehicleStatus(header=flight.header("drone_1"), flight_state=FlightState.FLYING, **state))
    for _ in range(60):
        flight.run(0.05)
        flight.tracker.setpoints(flight.now)
    assert drifts[-1] == pytest.approx(drift_m_s, abs=0.05)
