"""Summary over flights: flights are the samples, and their spread gives the confidence."""

import math

import msgspec
import numpy as np
import pytest

from groundstation.field.resolved import ResolvedField
from sim_bridge.study.summary import anees, interval, nis, summary


def field_of(lab: ResolvedField) -> ResolvedField:
    drone, camera = lab.drones["drone_1"], lab.cameras["ceiling"]
    assert lab.target is not None
    target = msgspec.structs.replace(lab.target, name="t")
    return msgspec.structs.replace(lab, drones={"a": drone, "b": drone}, cameras={"sky": camera}, target=target)


def report(a: float, t: float | None) -> dict:
    target = {} if t is None else {"t": t, "t xy": t}
    return {
        "target_rmse_m": 0.1,
        "target_lost_s": 0.0,
        "robot_max_m": {"a": 0.1 * a, "b": 0.2 * a},
        "anees": {"a": a, "a xy": a, "b": a + 1.0, "b xy": a + 1.0, **target},
        "nis": {"sky>a": 0.8, "sky>b": 1.2, "a>t": 2.0},
    }


def test_an_interval_holds_the_mean_as_often_as_it_says() -> None:
    """Student's 95 %: 2,000 samples of 50 normal values; binomial two-sided 99.9 % bounds for the count."""
    random = np.random.default_rng(3)
    found = [interval(random.normal(1.0, 0.4, 50)) for _ in range(2000)]
    hits = sum(abs(one.mean - 1.0) <= one.half for one in found)
    assert abs(hits - 1900) <= 3.3 * math.sqrt(2000 * 0.95 * 0.05)
    assert interval([0.5]).mean == 0.5
    assert math.isnan(interval([0.5]).half)


def test_an_interval_of_few_flights_is_as_wide_as_students() -> None:
    """Two values, one apart: Student's factor of one degree of freedom is 12.706, of two 4.303."""
    assert interval([1.0, 2.0]).half == pytest.approx(12.706 / 2.0, abs=1e-3)
    assert interval([1.0, 2.0, 3.0]).half == pytest.approx(4.303 / math.sqrt(3.0), abs=1e-3)


def test_a_flight_is_one_sample_whatever_it_saw(lab_field: ResolvedField) -> None:
    assert anees(report(1.0, None), ("a", "b")) == pytest.approx(1.5)
    assert math.isnan(anees(report(1.0, None), ("t",)))
    assert nis(report(1.0, 1.0), ("sky",)) == pytest.approx(1.0)
    found = summary([report(1.0, 0.9), report(1.2, None), report(0.8, 1.1)], field_of(lab_field))
    assert found["robot_max_m"].mean == pytest.approx(0.2), "the worst robot of each flight"
    assert found["anees robots"].mean == pytest.approx(1.5)
    assert found["anees target"].mean == pytest.approx(1.0)
    assert found["anees target"].flights == 2
    assert found["nis onboard cameras"].mean == pytest.approx(2.0)
