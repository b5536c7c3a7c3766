"""Faults of sensors, streams, clocks and people, and the estimator's response in flight.

It gives a verdict with its reason; the belief holds, or is corrected within seconds for that entity alone. Hovering
flights at message level, honest noise.
"""

from collections import defaultdict
from collections.abc import Callable

import msgspec
import numpy as np
import pytest

from groundstation.bus.messages import FlightState, Message, Odometry, RelativeObservation, VehicleStatus
from groundstation.estimation.layout import EntityKind
from groundstation.field.resolved import ResolvedField
from sim_bridge.scenario import Scenario
from sim_bridge.study.camera_model import Eye
from sim_bridge.study.runner import Study, StudyOptions
from sim_bridge.world.ardrone import Quadrotor

DRONES = ("drone_1", "drone_2")
BEGIN_S, END_S = 9.0, 11.0
Corrupt = Callable[[float, Message], list[tuple[float, Message]]]  # (simulated time, message) -> (delay [s], message)s


class Abused(Study):
    """A flight with corrupted messages; the effect on the belief, by entity."""

    def __init__(
        self, field: ResolvedField, corrupt: Corrupt, seed: int = 2, parked: bool = True, outliers: float = 0.0
    ) -> None:
        scenario = Scenario()
        if parked:
            target = scenario.target.model_copy(update={"departs_after_team_s": 100.0})
            scenario = scenario.model_copy(update={"target": target})
        super().__init__(field, scenario, StudyOptions(seed, 8.0, outliers, plan=False))
        self.corrupt = corrupt
        self.errors: defaultdict[str, list[tuple[float, float]]] = defaultdict(list)
        self.joined: list[tuple[float, str]] = []
        self.reasons: defaultdict[str, int] = defaultdict(int)
        for drone in self.world.of(Quadrotor).values():
            drone.autopilot.take_off()

    def _send(self, arrival_ns: int, key: str, message: Message) -> None:
        for delay_s, one in self.corrupt(self.world.time_s, message):
            super()._send(arrival_ns + round(delay_s * 1e9), key, one)

    def fly(self, until_s: float = 14.0) -> "Abused":
        note = self.score.note

        def watch(correction):
            note(correction)
            self.reasons[correction.reason] += 1
            if correction.joined:
                self.joined.append((self.world.time_s, correction.subject))

        self.score.note = watch  # type: ignore[method-assign] # listens in
        while self.world.time_s < until_s:
            self.step()
            if self.world.ticks % 10 == 0:
                self._compare()
        return self

    def _compare(self) -> None:
        truth = dict(zip(self.world.bodies, self.world.states(), strict=True))
        for block in self.tracker.belief.layout.blocks:
            if block.kind is not EntityKind.CAMERA:
                gap = self.tracker.belief.mean_of(block.name)[:2] - truth[block.name][:2]
                self.errors[block.name].append((self.world.time_s, float(np.hypot(*gap))))

    def worst(self, name: str, since_s: float = BEGIN_S) -> float:
        return max(error for at, error in self.errors[name] if at >= since_s)

    def worst_height_m(self) -> float:
        """Return the largest current height error: of drones, and of the ceiling camera."""
        belief, truth = self.tracker.belief, dict(zip(self.world.bodies, self.world.states(), strict=True))
        true = {name: float(truth[name][2]) for name in DRONES}
        true |= {
            eye.name: float(eye._position[2]) for eye in self._eyes if isinstance(eye, Eye) and eye.name not in DRONES
        }
        return max(abs(float(belief.mean_of(name)[2]) - z) for name, z in true.items())

    def joined_again(self) -> set[str]:
        return {name for at, name in self.joined if at > BEGIN_S}


def during(now_s: float) -> bool:
    return BEGIN_S <= now_s < END_S


def as_it_is(now_s: float, message: Message) -> list[tuple[float, Message]]:
    return [(0.0, message)]


def shifted(message: Message, seconds: float) -> Message:
    stamp_ns = message.header.stamp_ns + round(seconds * 1e9)
    return msgspec.structs.replace(message, header=msgspec.structs.replace(message.header, stamp_ns=stamp_ns))


def frozen(kind: type) -> Corrupt:
    """Repeat this kind of message as it was when the sensor froze; stamps and numbers continue."""
    last: dict[tuple[str, str], Message] = {}

    def corrupt(now_s: float, message: Message) -> list[tuple[float, Message]]:
        if not isinstance(message, kind):
            return [(0.0, message)]
        source = (message.header.entity, getattr(message, "subject", ""))
        if during(now_s) and source in last:
            return [(0.0, msgspec.structs.replace(last[source], header=message.header))]
        last[source] = message
        return [(0.0, message)]

    return corrupt


def test_an_undisturbed_hover_is_the_measure(lab_field: ResolvedField) -> None:
    flight = Abused(lab_field, as_it_is).fly()
    assert max(flight.worst(name) for name in (*DRONES, "turtlebot")) < 0.12
    assert flight.joined_again() == set()


def test_markers_that_are_read_as_each_other_for_seconds_move_nobody(lab_field: ResolvedField) -> None:
    other = {"drone_1": "drone_2", "drone_2": "drone_1"}

    def corrupt(now_s: float, message: Message) -> list[tuple[float, Message]]:
        if during(now_s) and isinstance(message, RelativeObservation) and message.subject in other:
            message = msgspec.structs.replace(message, subject=other[message.subject])
        return [(0.0, message)]

    flight = Abused(lab_field, corrupt).fly()
    assert flight.joined_again() == set()
    assert max(flight.worst(name) for name in DRONES) < 0.25
    assert max(flight.worst(name, END_S + 0.5) for name in DRONES) < 0.12
    assert sum(n for reason, n in flight.reasons.items() if "another entity" in reason) > 20


@pytest.mark.parametrize("kind", [Odometry, RelativeObservation])
def test_a_sensor_that_freezes_is_named_and_does_little_harm(lab_field: ResolvedField, kind: type) -> None:
    flight = Abused(lab_field, frozen(kind)).fly()
    assert flight.tracker.rejected[f"{kind.__name__} FROZEN"] > 20
    assert max(flight.worst(name) for name in DRONES) < 0.4
    assert max(flight.worst(name, END_S + 1.0) for name in (*DRONES, "turtlebot")) < 0.12


@pytest.mark.parametrize(("hours", "verdict"), [(-1.0, "LATE"), (1.0, "IMPLAUSIBLE")])
def test_stamps_that_jump_by_an_hour_are_refused_by_name(lab_field: ResolvedField, hours: float, verdict: str) -> None:
    def corrupt(now_s: float, message: Message) -> list[tuple[float, Message]]:
        return [(0.0, shifted(message, 3600 * hours) if during(now_s) else message)]

    flight = Abused(lab_field, corrupt).fly()
    for kind in ("Odometry", "RelativeObservation", "VehicleStatus"):
        assert flight.tracker.rejected[f"{kind} {verdict}"] >= 10, kind
    assert max(flight.worst(name, END_S + 1.0) for name in (*DRONES, "turtlebot")) < 0.12
    assert flight.joined_again() == set()


@pytest.mark.slow
@pytest.mark.study
def test_messages_that_come_again_at_once_and_much_later_change_nothing(lab_field: ResolvedField) -> None:
    def corrupt(now_s: float, message: Message) -> list[tuple[float, Message]]:
        return [(delay, message) for delay in (0.0, 0.001, 0.3, 11.0)]

    once, again = Abused(lab_field, as_it_is).fly(19.0), Abused(lab_field, corrupt).fly(19.0)
    assert np.array_equal(once.tracker.belief.mean, again.tracker.belief.mean)
    assert np.array_equal(once.tracker.belief.covariance, again.tracker.belief.covariance)
    for kind in ("Odometry", "RelativeObservation", "VehicleStatus"):
        assert again.tracker.rejected[f"{kind} DUPLICATE"] > 20, kind
    assert again.tracker.rejected["Odometry LATE"] > 600, "more came in between than are remembered"


def test_a_landing_of_the_past_that_comes_late_lands_nobody(lab_field: ResolvedField) -> None:
    def corrupt(now_s: float, message: Message) -> list[tuple[float, Message]]:
        out = [(0.0, message)]
        if during(now_s) and isinstance(message, VehicleStatus):
            past = msgspec.structs.replace(message, flight_state=FlightState.LANDED)
            out.append((0.001, shifted(past, -5.0)))
        return out

    flight = Abused(lab_field, corrupt).fly()
    assert flight.tracker.rejected["VehicleStatus LATE"] >= 10
    assert set(flight.tracker.belief.layout.robots) == set(DRONES)
    assert flight.joined_again() == set()


def test_wild_sightings_by_the_dozen_move_nobody(lab_field: ResolvedField) -> None:
    random = np.random.default_rng(7)

    def corrupt(now_s: float, message: Message) -> list[tuple[float, Message]]:
        if during(now_s) and isinstance(message, RelativeObservation) and random.random() < 0.3:
            place = np.add(message.position_m, random.normal(0.0, 1.5, 3))
            message = msgspec.structs.replace(message, position_m=(place[0], place[1], abs(place[2]) + 0.1))
        return [(0.0, message)]

    flight = Abused(lab_field, corrupt).fly()
    assert max(flight.worst(name) for name in (*DRONES, "turtlebot")) < 0.15
    assert flight.joined_again() == set()


@pytest.mark.parametrize("name", [*DRONES, "turtlebot"])
def test_initialisation_by_an_outlier_is_corrected_by_the_next_observation(lab_field: ResolvedField, name: str) -> None:
    """Otherwise an overconfident robot drags along its observers and the ceiling camera's mounting."""
    used = []

    def corrupt(now_s: float, message: Message) -> list[tuple[float, Message]]:
        if isinstance(message, RelativeObservation) and message.subject == name and not joined and now_s > 4.0:
            used.append(now_s)
            place = np.add(message.position_m, (0.7, -0.5, 0.6))
            message = msgspec.structs.replace(message, position_m=tuple(place.tolist()))
        return [(0.0, message)]

    joined: list[bool] = []
    flight = Abused(lab_field, corrupt)
    take = flight.score.note

    def watch(correction):
        take(correction)
        joined.extend([True] if correction.joined and correction.subject == name else [])

    flight.score.note = watch  # type: ignore[method-assign] # listens in
    while not joined:
        flight.step()
    assert used
    flight.fly(BEGIN_S + 3.0)
    assert max(flight.worst(one) for one in (*DRONES, "turtlebot")) < 0.12


def test_a_kidnapped_target_is_found_again_and_nobody_else_doubted(lab_field: ResolvedField) -> None:
    flight = Abused(lab_field, as_it_is).fly(BEGIN_S)
    target = flight.world.targets["turtlebot"]
    target.place(target.x - 0.3, target.y)
    flight.fly()
    assert flight.joined_again() <= {"turtlebot"}
    assert flight.worst("turtlebot", BEGIN_S + 2.0) < 0.12
    assert max(flight.worst(name) for name in DRONES) < 0.12


def test_a_kidnapped_robot_is_found_again_and_does_not_take_the_target_along(lab_field: ResolvedField) -> None:
    flight = Abused(lab_field, as_it_is).fly(BEGIN_S)
    flight.world.of(Quadrotor)["drone_1"].airframe.x += 0.7
    flight.fly()
    assert flight.joined_again() == {"drone_1"}
    assert flight.worst("drone_1", BEGIN_S + 2.0) < 0.12
    assert max(flight.worst(name) for name in ("drone_2", "turtlebot")) < 0.15


@pytest.mark.parametrize("seed", [5, 7, 10, 12])
def test_outliers_among_first_sightings_bend_no_height(lab_field: ResolvedField, seed: int) -> None:
    """One observation in ten is grossly wrong.

    A target's first observation has a redundant row, which bent its observer and the ceiling camera with it (5, 7);
    drones initialised by outliers are corrected by the next observation (10, 12).
    """
    flight = Abused(lab_field, as_it_is, seed, parked=False, outliers=0.1).fly(BEGIN_S)
    assert flight.worst_height_m() < 0.04
    assert max(flight.worst(name, 7.0) for name in DRONES) < 0.12
    assert set(DRONES) <= {block.name for block in flight.tracker.belief.layout.blocks}
    assert "turtlebot" in {name for _, name in flight.joined}  # driving off it leaves all pictures, and is searched for


@pytest.mark.parametrize(
    "seed", [1, *(pytest.param(seed, marks=(pytest.mark.slow, pytest.mark.study)) for seed in (2, 3))]
)
def test_displaced_entities_are_relocated_among_outliers(lab_field: ResolvedField, seed: int) -> None:
    flight = Abused(lab_field, as_it_is, seed, outliers=0.1).fly(BEGIN_S)
    target = flight.world.targets["turtlebot"]
    target.place(target.x - 0.3, target.y)
    flight.fly(BEGIN_S + 2.5)
    flight.world.of(Quadrotor)["drone_1"].airframe.x += 0.7
    flight.fly(BEGIN_S + 5.0)
    assert flight.worst("turtlebot", BEGIN_S + 4.5) < 0.12
    assert max(flight.worst(name, BEGIN_S + 4.5) for name in DRONES) < 0.12
    assert flight.worst_height_m() < 0.04


def test_after_a_suspension_of_an_hour_everybody_is_looked_for_anew(lab_field: ResolvedField) -> None:
    flight = Abused(lab_field, as_it_is).fly(BEGIN_S)
    now_ns = flight.now_ns + 3600 * 10**9
    flight.tracker.advance(now_ns)
    assert flight.tracker.belief.layout.robots == ()
    assert flight.tracker.belief.stamp_ns == now_ns
    assert flight.tracker.airborne == DRONES
