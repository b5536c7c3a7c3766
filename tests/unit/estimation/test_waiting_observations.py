"""Observations that wait for the odometry of their time: the same belief later, computed once."""

import math
from dataclasses import replace
from typing import Any

import msgspec
import numpy as np
import pytest

from groundstation.bus.messages import Verdict
from groundstation.estimation import fixed_lag
from groundstation.estimation.filter_state import Span
from groundstation.estimation.fixed_lag import FixedLagFilter
from groundstation.estimation.measurement import Measurement, OdometrySample
from groundstation.estimation.models import ConstantVelocityTarget, FixedMount, MountedCamera, OdometryRobot
from groundstation.estimation.parameters import WORLD_FROM_DOWN, EstimatorParameters, parameters_from_field
from groundstation.estimation.replay import replay
from groundstation.field.resolved import ResolvedField
from groundstation.geometry.rotations import base_from_tilted_optical

MS = 1_000_000
START = 5_000_000_000_000
FOUR, THREE = (tuple(np.diag(row).ravel().tolist()) for row in ([1e-4, 1e-4, 4e-4, 1e-3], [1e-4, 1e-4, 4e-4]))
AT_ONCE = EstimatorParameters(
    {"a": OdometryRobot(), "t": ConstantVelocityTarget(), "ceiling": FixedMount((0.0, 0.0, 4.2), 0.0035, 0.01)},
    {
        "ceiling": MountedCamera("ceiling", WORLD_FROM_DOWN, observes_targets=False),
        "a": MountedCamera("a", base_from_tilted_optical(math.radians(45)), (0.09, 0.0, 0.0)),
    },
)
WAITING = replace(AT_ONCE, wait_s=0.095)


class Flight:
    """A robot under a camera; on arrival its velocity is 30 and its height 85 ms old, pictures 5 ms."""

    def __init__(self, parameters: EstimatorParameters) -> None:
        self.joint, self.now, self._rng = FixedLagFilter(parameters), START, np.random.default_rng(7)
        self.joint.set_airborne("a", True, START, START)
        self._late: list[Measurement] = []

    def fly(self, milliseconds: int, seen: bool = True) -> None:
        for _ in range(milliseconds // 5):
            self.now += 5 * MS
            sample = OdometrySample(
                self.now, (0.2, 0.02 * self._rng.normal(), 0.0), 0.1, 1.3 + 0.01 * self._rng.normal()
            )
            assert self.joint.add_motion("a", sample, self.now) is Verdict.ACCEPTED
            for sight in self._late:
                tie = sight.camera + sight.subject
                assert self.joint.add_observation(sight, tie, self.now) is None
            self._late = self._pictures() if seen and self.now // MS % 35 == 0 else []
            if self.now // MS % 20 == 0:
                self.joint.advance(self.now)

    def _pictures(self) -> list[Measurement]:
        x = 0.2 * (self.now - START) / 1e9
        noise = 0.01 * self._rng.normal(size=6)
        return [
            Measurement(self.now, "ceiling", "a", (x + noise[0], noise[1], 2.9 + noise[2]), 0.1, FOUR),
            Measurement(self.now, "a", "t", (noise[3], noise[4], 1.2 + noise[5]), None, THREE),
        ]


def test_waiting_observations_give_the_same_belief() -> None:
    flights = [Flight(parameters) for parameters in (AT_ONCE, WAITING)]
    for _ in range(2):  # rounding differences of the present beliefs do not accumulate
        for flight in flights:
            flight.fly(700)
            flight.fly(200, seen=False)
        at_once, waited = (flight.joint.belief() for flight in flights)
        assert at_once.layout == waited.layout and set(waited.layout.robots + waited.layout.targets) == {"a", "t"}
        np.testing.assert_array_equal(waited.mean, at_once.mean)
        for name in ("a", "t", "ceiling"):
            np.testing.assert_array_equal(waited.covariance_of(name), at_once.covariance_of(name))
        # Between entities, the waiting steps are multiplied before they move P (ahead.py).
        np.testing.assert_allclose(waited.covariance, at_once.covariance, rtol=1e-12, atol=1e-20)


def test_an_observation_counts_once_the_odometry_of_its_time_is_there() -> None:
    flight = Flight(WAITING)
    flight.fly(600)
    flight.joint.take_corrections()
    flight.fly(200, seen=False)
    flight.joint.take_corrections()
    known = flight.joint.belief().covariance_of("a")[0, 0]
    sight = Measurement(flight.now, "ceiling", "a", (0.2 * (flight.now - START) / 1e9, 0.0, 2.9), 0.1, FOUR)
    assert flight.joint.add_observation(sight, "x", flight.now) is None
    flight.fly(80, seen=False)
    assert flight.joint.take_corrections() == []
    assert flight.joint.belief().covariance_of("a")[0, 0] > known
    flight.fly(40, seen=False)
    (told,) = flight.joint.take_corrections()
    assert told.verdict is Verdict.ACCEPTED
    assert flight.joint.belief().covariance_of("a")[0, 0] < known


def test_an_entity_that_left_is_not_restored_by_waiting_observations() -> None:
    flight = Flight(WAITING)
    flight.fly(600)
    assert "t" in flight.joint.belief().layout
    flight.joint.set_present("t", False, flight.now, flight.now)
    flight.joint.advance(flight.now)
    assert "t" not in flight.joint.belief().layout
    flight.joint.set_present("t", True, flight.now, flight.now)
    flight.fly(60, seen=False)
    assert "t" not in flight.joint.belief().layout


@pytest.mark.parametrize(("parameters", "most"), [(AT_ONCE, 13), (WAITING, 3)])
def test_late_odometry_has_nothing_computed_again_that_waits(
    parameters: EstimatorParameters, most: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    spans: list[Span] = []

    def noted(*values: Any) -> None:
        spans.extend(value for value in values if isinstance(value, Span))
        replay(*values)

    monkeypatch.setattr(fixed_lag, "replay", noted)
    Flight(parameters).fly(600)
    computed = [span.waiting - span.first for span in spans[10:]]
    assert computed and max(computed) <= most and (most < 5 or max(computed) > 8)


@pytest.mark.parametrize(("count", "wait_s"), [(2, 0.0), (11, 0.0), (12, 0.095), (30, 0.095)])
def test_a_large_team_waits_for_its_latest_odometry(lab_field: ResolvedField, count: int, wait_s: float) -> None:
    drone = next(iter(lab_field.drones.values()))
    team = msgspec.structs.replace(lab_field, drones={f"drone_{k}": drone for k in range(count)})
    assert parameters_from_field(team).wait_s == pytest.approx(wait_s)
