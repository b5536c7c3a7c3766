"""Consistency of the belief: normalised errors over seeded flights of the honest scenario.

The scenario has delays, drop-outs and 2 % gross outliers. Errors within a flight are correlated (a ceiling camera has
one mounting error all along), so flights are the samples: the test judges the mean over flights of a flight's mean
NEES, or NIS, per degree of freedom. It states its two-sided 95 % t-interval, which must be narrow enough for the band
0.8..1.3 to mean something.

The lab is flown as shipped. Its target model leaves room for turns on the spot, so its velocity is known better there
than stated, by design; the consistency of a target's whole state is judged with one that moves by its model (decision
0206).
"""

import math
from typing import Any

import numpy as np
import pytest
from msgspec import structs

from groundstation.estimation.models import ConstantVelocityTarget
from groundstation.estimation.parameters import parameters_from_field
from groundstation.field.resolved import ResolvedField
from sim_bridge.scenario import Scenario
from sim_bridge.study.runner import Study, StudyOptions
from sim_bridge.study.summary import summary
from sim_bridge.world.noise import generator_of
from sim_bridge.world.world import TICK_S

pytestmark = pytest.mark.statistics
# So that a target that moves by this density stays in the room.
GENTLE_M_S2 = 0.2
DURATION_S, OUTLIERS = 25.0, 0.02
# Number of flights; the interval of few is wide.
MANY = 50
FLIGHTS = [pytest.param(16, id="16"), pytest.param(MANY, id="50", marks=pytest.mark.exhaustive)]
FIRST_SEED = 100
LOW, HIGH = 0.8, 1.3
Reports = list[dict[str, Any]]


class Wanderer:
    """A target moved only by white acceleration of a density [m^2/s^3], once it has departed."""

    def __init__(self, density: float, rng: np.random.Generator) -> None:
        self._kick_m_s, self._rng = math.sqrt(density * TICK_S), rng
        self.x = self.y = self.vx = self.vy = 0.0
        self.parked = True

    def step(self) -> None:
        if not self.parked:
            self.vx += self._kick_m_s * float(self._rng.standard_normal())
            self.vy += self._kick_m_s * float(self._rng.standard_normal())
        self.x, self.y = self.x + self.vx * TICK_S, self.y + self.vy * TICK_S

    def confine(self, half_x_m: float, half_y_m: float) -> None:
        assert abs(self.x) < half_x_m and abs(self.y) < half_y_m, "no target is believed to stop at a wall"

    def row(self) -> tuple[float, ...]:
        return (self.x, self.y, 0.0, self.vx, self.vy, *[0.0] * 7, 1.0)


def with_wanderer(study: Study, field: ResolvedField, seed: int) -> Study:
    """Return a study whose target moves exactly by its filter's model."""
    assert field.target is not None
    believed = parameters_from_field(field).entities[field.target.name]
    assert isinstance(believed, ConstantVelocityTarget)
    density = believed.acceleration_std_m_s2**2 * believed.correlation_s
    targets: dict[str, Any] = study.world.targets
    targets[field.target.name] = Wanderer(density, generator_of(seed, "wanderer"))
    return study


def fly(field: ResolvedField, seeds: range, duration_s: float, outliers: float) -> Reports:
    return [Study(field, Scenario(), StudyOptions(seed, duration_s, outliers)).run() for seed in seeds]


def judge(reports: Reports, field: ResolvedField, names: tuple[str, ...]) -> None:
    """Few flights fail when the whole interval of their mean is outside; many when their mean is."""
    found = summary(reports, field)
    stated = {name: f"{found[name]} (95 %, {found[name].flights} flights)" for name in names}
    print(stated)
    widest = 0.3 * math.sqrt(MANY / len(reports))
    for name in names:
        slack = 0.0 if len(reports) >= MANY else found[name].half
        assert LOW - slack <= found[name].mean <= HIGH + slack and found[name].half <= widest, stated


@pytest.mark.slow
def test_a_few_short_flights_are_near_consistent(lab_field: ResolvedField) -> None:
    """4 flights of 12 s: a coarse alarm, wide enough for so few."""
    found = summary(fly(lab_field, range(1, 5), 12.0, 0.0), lab_field)
    assert 0.3 <= found["anees robots"].mean <= 1.8
    assert 0.3 <= found["anees target"].mean <= 1.8
    assert 0.6 <= found["nis fixed cameras"].mean <= 1.5


@pytest.fixture(scope="module", params=FLIGHTS)
def flights(request: pytest.FixtureRequest, lab_field: ResolvedField) -> Reports:
    """Some 2.8 s of CPU each. 25 s hold a whole approach, several changes of topology and 900 sightings per flight."""
    return fly(lab_field, range(FIRST_SEED, FIRST_SEED + request.param), DURATION_S, OUTLIERS)


@pytest.mark.slow
@pytest.mark.timeout(3000)
def test_flights_are_consistent_in_state(flights: Reports, lab_field: ResolvedField) -> None:
    judge(flights, lab_field, ("anees robots", "anees robots xy", "anees target xy"))
    assert summary(flights, lab_field)["anees target"].mean <= HIGH, "it has room for turns, and may not be too sure"


@pytest.mark.slow
@pytest.mark.timeout(3000)
def test_flights_are_consistent_in_innovation(flights: Reports, lab_field: ResolvedField) -> None:
    judge(flights, lab_field, ("nis fixed cameras",))
    assert summary(flights, lab_field)["nis onboard cameras"].mean <= HIGH, "the target's room is in what they expect"


@pytest.mark.slow
@pytest.mark.timeout(3000)
def test_flights_with_outliers_hold_the_target(flights: Reports) -> None:
    errors = np.array([report["target_rmse_m"] for report in flights])
    assert np.sqrt(np.mean(errors**2)) <= 0.12
    assert np.mean([report["target_lost_s"] for report in flights]) <= 0.1, "on average, from the beginning of tracking"


@pytest.mark.slow
@pytest.mark.timeout(3000)
@pytest.mark.parametrize("count", FLIGHTS)
def test_a_target_that_moves_as_it_is_believed_to_is_known_as_well_as_is_said(
    lab_field: ResolvedField, count: int
) -> None:
    """The remaining errors are the filter's: delays, rewinds, the mounting's states, correlations between robots."""
    assert lab_field.target is not None
    field = structs.replace(lab_field, target=structs.replace(lab_field.target, acceleration_std_m_s2=GENTLE_M_S2))
    reports = []
    for seed in range(FIRST_SEED, FIRST_SEED + count):
        study = Study(field, Scenario(), StudyOptions(seed, DURATION_S, OUTLIERS))
        reports.append(with_wanderer(study, field, seed).run())
    states = ("anees robots", "anees robots xy", "anees target", "anees target xy")
    judge(reports, field, (*states, "nis fixed cameras", "nis onboard cameras"))
