"""Is the belief as good as it says? Normalised errors over seeded flights of the honest scenario: delays, drop-outs,
2 % gross outliers.

Errors within a flight last (a ceiling camera hangs wrong all along), so flights are the samples: judged is the mean
over flights of a flight's mean NEES, or NIS, per degree of freedom. Its two-sided 95 % t-interval is stated; it must
be narrow enough for the band 0.8..1.3 to mean something.

The target is believed as gentle as the scenario's is (it never leaves its eight): a shipped field leaves it room for
turns on the spot, and its covariance is then too large for an eight, by design.
"""

import math
from typing import Any

import numpy as np
import pytest
from msgspec import structs

from groundstation.field.resolved import ResolvedField
from sim_bridge.scenario import Scenario
from sim_bridge.study.runner import Study, StudyOptions
from sim_bridge.study.summary import summary

pytestmark = pytest.mark.statistics
GENTLE_M_S2 = 0.3
DURATION_S, OUTLIERS = 25.0, 0.02
# So many flights; the interval of few is wide.
MANY = 50
FLIGHTS = [pytest.param(16, id="16"), pytest.param(MANY, id="50", marks=pytest.mark.exhaustive)]
LOW, HIGH = 0.8, 1.3
Reports = list[dict[str, Any]]


@pytest.fixture(scope="module")
def gentle_field(lab_field: ResolvedField) -> ResolvedField:
    assert lab_field.target is not None
    return structs.replace(lab_field, target=structs.replace(lab_field.target, acceleration_std_m_s2=GENTLE_M_S2))


def fly(field: ResolvedField, seeds: range, duration_s: float, outliers: float) -> Reports:
    return [Study(field, Scenario(), StudyOptions(seed, duration_s, outliers)).run() for seed in seeds]


def judge(reports: Reports, field: ResolvedField, names: tuple[str, ...]) -> None:
    """Few flights are outside when the whole interval of their mean is; many when their mean is."""
    found = summary(reports, field)
    stated = {name: f"{found[name]} (95 %, {found[name].flights} flights)" for name in names}
    print(stated)
    widest = 0.3 * math.sqrt(MANY / len(reports))
    for name in names:
        slack = 0.0 if len(reports) >= MANY else found[name].half
        assert LOW - slack <= found[name].mean <= HIGH + slack and found[name].half <= widest, stated


def test_a_few_short_flights_are_near_consistent(gentle_field: ResolvedField) -> None:
    """4 flights of 12 s: a coarse alarm, wide enough for so few."""
    found = summary(fly(gentle_field, range(1, 5), 12.0, 0.0), gentle_field)
    assert 0.3 <= found["anees robots"].mean <= 1.8
    assert 0.3 <= found["anees target"].mean <= 1.8
    assert 0.6 <= found["nis fixed cameras"].mean <= 1.5


@pytest.fixture(scope="module", params=FLIGHTS)
def flights(request: pytest.FixtureRequest, gentle_field: ResolvedField) -> Reports:
    """Some 2.8 s of CPU each. 25 s hold a whole approach, several changes of topology and 900 sightings per flight."""
    return fly(gentle_field, range(100, 100 + request.param), DURATION_S, OUTLIERS)


@pytest.mark.slow
@pytest.mark.timeout(3000)
def test_flights_are_consistent_in_state(flights: Reports, gentle_field: ResolvedField) -> None:
    judge(flights, gentle_field, ("anees robots", "anees robots xy", "anees target", "anees target xy"))


@pytest.mark.slow
@pytest.mark.timeout(3000)
def test_flights_are_consistent_in_innovation(flights: Reports, gentle_field: ResolvedField) -> None:
    judge(flights, gentle_field, ("nis fixed cameras", "nis onboard cameras"))


@pytest.mark.slow
@pytest.mark.timeout(3000)
def test_flights_with_outliers_hold_the_target(flights: Reports) -> None:
    errors = np.array([report["target_rmse_m"] for report in flights])
    assert np.sqrt(np.mean(errors**2)) <= 0.12
    assert np.mean([report["target_lost_s"] for report in flights]) <= 0.1, "on average, from the beginning of tracking"
