"""The planar simulation: paths, filter, readings, and runs that repeat bit for bit."""

import json
import math
from itertools import pairwise

import numpy as np
import pytest

from groundstation.experiments.closed_loop import SimulationSettings, all_pairs, edges_of, forget_target, observe
from groundstation.experiments.filter import correct, initial_belief, predict
from groundstation.experiments.paths import figure_eight, receding
from groundstation.experiments.planar.parameters import FIGURE_1
from groundstation.experiments.sensors import SENSORS, compare, radial_compositions, reading_model
from groundstation.experiments.strategies import STRATEGIES, Strategy
from groundstation.experiments.summary import add_ratios, summarise
from groundstation.experiments.tasks import SETUPS, Task, csv_text, execute, simulate
from groundstation.sensing.topology import LEAF, ROOT, Topology


def test_figure_eight_has_the_papers_extent_and_speed() -> None:
    path = figure_eight()
    points = np.array([path(0.1 * k) for k in range(225)])
    assert np.abs(points[:, 0]).max() == pytest.approx(1.21, abs=0.01)
    assert np.abs(points[:, 1]).max() == pytest.approx(0.5, abs=0.01)
    steps = np.hypot(*np.diff(points, axis=0).T)
    assert steps.max() <= 0.03 + 1e-9
    assert np.median(steps) == pytest.approx(0.03, rel=1e-2)
    assert np.hypot(*points[0]) == 0.0
    assert np.hypot(*points[224]) < 0.04


def test_receding_target() -> None:
    path = receding(1.2, 0.02, math.pi / 2)
    np.testing.assert_allclose(path(10.0), [0.0, 1.4], atol=1e-12)


def test_filter_is_a_textbook_kalman_filter() -> None:
    generator = np.random.default_rng(0)
    belief = initial_belief(generator.normal(size=(4, 2)), 1e-2, target_velocity=True)
    mean, covariance = belief.mean.copy(), belief.covariance.copy()
    velocity = generator.normal(size=(3, 2))
    belief = predict(belief, velocity, 0.1, 1e-3, 2e-2)
    transition, noise = np.eye(5), np.diag([1e-3, 1e-3, 1e-3, 0.0, 2e-2])
    transition[3, 4] = 0.1
    mean = transition @ mean
    mean[:3] += 0.1 * velocity
    covariance = transition @ covariance @ transition.T + noise
    for observer, subject in ((-1, 0), (0, 2), (2, 3)):
        reading = generator.normal(size=2)
        row = np.zeros(5)
        row[subject] = 1.0
        if observer >= 0:
            row[observer] = -1.0
        gain = covariance @ row / (row @ covariance @ row + 4e-4)
        mean = mean + np.outer(gain, reading - row @ mean)
        covariance = covariance - np.outer(gain, row @ covariance)
        belief = correct(belief, observer, subject, reading, 4e-4)
    np.testing.assert_allclose(belief.mean, mean, rtol=1e-10)
    np.testing.assert_allclose(belief.covariance, covariance, rtol=1e-9, atol=1e-15)
    np.testing.assert_allclose(belief.target_velocity, mean[4])


def test_edges_are_those_of_the_topology() -> None:
    level = np.array([1, 0, 1, 2])
    topology = Topology.parse("b/a,c/d")
    names = {-1: ROOT, **dict(enumerate("abcd")), 4: LEAF}
    assert {(names[a], names[b]) for a, b in edges_of(level)} == set(topology.edges())
    assert (-1, 4) not in all_pairs(4) and len(all_pairs(4)) == 4 + 4 * 4


def test_no_reading_beyond_range_and_none_of_the_lost() -> None:
    truth = np.array([[0.4, 0.0], [0.8, 0.0], [1.4, 0.0]])
    belief, generator = initial_belief(truth, 1e-2, False), np.random.default_rng(0)
    level, settings = np.array([0, 1]), SimulationSettings(1)
    assert observe(belief, truth, level, FIGURE_1, settings, generator)[1] == 2
    assert observe(belief, truth, level, FIGURE_1, SimulationSettings(1, dropout=1.0), generator)[1] == 0
    assert observe(belief, truth, level, FIGURE_1, SimulationSettings(1, range_m=10.0), generator)[1] == 3
    everything = SimulationSettings(1, range_m=10.0, fuse_all=True)
    assert observe(belief, truth, level, FIGURE_1, everything, generator)[1] == len(all_pairs(2))


def test_forgotten_target_keeps_the_robots() -> None:
    belief = initial_belief(np.zeros((3, 2)), 1e-2, True)
    forgotten = forget_target(belief)
    assert np.diag(forgotten.covariance).tolist() == [1e-2, 1e-2, 4.0, 4.0]


@pytest.mark.parametrize("strategy", STRATEGIES)
@pytest.mark.parametrize("experiment", SETUPS)
def test_runs_repeat_bit_for_bit(experiment: str, strategy: str) -> None:
    task = Task(experiment, 3, strategy, 7, steps=8, dropout=0.2, kidnap=0.1)
    first, second = execute(task), execute(task)
    assert first["merits"] == second["merits"]
    assert csv_text([first]) == csv_text([second])
    assert execute(Task(experiment, 3, strategy, 8, steps=8))["merits"] != first["merits"]
    assert json.loads(json.dumps(first))["merits"] == first["merits"]


def test_figure_1_from_string_over_two_to_three_levels() -> None:
    merits = [execute(Task("figure1", 5, "paper", seed))["merits"] for seed in (1, 2)]
    assert all(m["as_in_the_paper"] and not m["lost"] for m in merits)


def test_certified_switches_to_few_levels_where_the_paper_is_trapped() -> None:
    rows = [execute(Task("teams", 10, strategy, 1, steps=30)) for strategy in ("paper", "certified")]
    entries = summarise(rows)
    add_ratios(entries)
    assert entries[0]["trace_ratio_to_paper"] == 1.0
    assert entries[1]["trace_ratio_to_paper"] < 0.75


def test_kidnapped_target_is_tracked_again_with_unlimited_range() -> None:
    steps = simulate(Task("figure-eight", 3, "certified", 3, range_m=50.0, noise_growth=0.0, kidnap=0.02))
    jumped = [k for k, (a, b) in enumerate(pairwise(steps)) if np.hypot(*(b.truth[-1] - a.truth[-1])) > 0.1]
    assert jumped
    assert all(steps[min(k + 5, 223)].error_m < 0.3 for k in jumped)


def test_wrong_names_are_told() -> None:
    with pytest.raises(ValueError, match="unknown experiment"):
        simulate(Task("figure2", 3, "paper", 1))
    with pytest.raises(ValueError, match="unknown strategy"):
        Strategy("best", 3, FIGURE_1, np.random.default_rng(0))


def test_equal_tasks_have_equal_keys_only(monkeypatch: pytest.MonkeyPatch) -> None:
    task = Task("teams", 3, "paper", 1)
    assert task.key == (key := Task("teams", 3, "paper", 1).key)
    assert len({task.key, Task("teams", 3, "paper", 2).key, Task("teams", 3, "paper", 1, dropout=0.1).key}) == 3
    monkeypatch.setattr("groundstation.experiments.tasks.program_digest", lambda *_: "of another program")
    assert task.key != key, "a sweep goes on in a folder of results only with the program that made them"


@pytest.mark.parametrize("sensor", SENSORS, ids=lambda sensor: sensor.name)
def test_sensor_jacobians(sensor: object) -> None:
    offset, ahead = np.array([0.21, -0.13]), np.array([1.0, 0.0])
    model = reading_model(sensor, offset, ahead)  # type: ignore[arg-type]
    assert model is not None
    for axis in range(2):
        step = np.zeros(2)
        step[axis] = 1e-6
        ahead_of = reading_model(sensor, offset + step, ahead)  # type: ignore[arg-type]
        behind = reading_model(sensor, offset - step, ahead)  # type: ignore[arg-type]
        assert ahead_of is not None and behind is not None
        np.testing.assert_allclose(model[1][:, axis], (ahead_of[0] - behind[0]) / 2e-6, rtol=1e-4, atol=1e-6)


def test_sensors_have_a_winner_each() -> None:
    assert len(radial_compositions(4)) == 8
    rows = compare(3, range(1), SENSORS[:2])
    assert len(rows) == 8
    assert sum(row["wins"] for row in rows) == 2
    assert rows == compare(3, range(1), SENSORS[:2])
