"""`groundstation bench estimator` compares filters that agree, on a path with only explained observations."""

import json

import numpy as np
import pytest
from click.testing import CliRunner

from groundstation.bench import estimator as estimator_bench
from groundstation.bench import estimator_path, estimator_peers
from groundstation.bench.estimator_team import frame_of, joined_state, minimal_parameters, team_of
from groundstation.bus import codec, keys
from groundstation.bus.messages import Innovation, Verdict
from groundstation.bus.topics import INNOVATION
from groundstation.cli import bench_estimator
from groundstation.estimation.records import EventRow

Row = dict[str, float | str]


def test_the_team_has_the_edges_that_are_asked_for():
    team = team_of(minimal_parameters(30))
    assert len(team.edges) == len(set(team.edges)) == 255
    assert team.tables.dim == 30 * 4 + 4 + 6
    assert len(team_of(minimal_parameters(5)).edges) == 3 + 6 + 2


def test_all_filters_have_the_same_belief_on_the_same_data():
    differences = estimator_bench.same_belief(team_of(minimal_parameters(6)), seed=4)
    assert differences["numpy"] < 1e-9
    assert differences["filterpy"] < 1e-9
    # Linearised once per frame: close, but not the same filter.
    assert 1e-9 < differences["numpy-batch"] < 5e-3


def test_a_batch_of_one_edge_is_a_correction_like_any_other():
    team, rng = team_of(minimal_parameters(4)), np.random.default_rng(2)
    state, frame = joined_state(team, rng), EventRow.rows(1)
    np.asarray(frame)[:] = np.asarray(frame_of(team, rng))[3]
    peers = estimator_peers.contestants(team, state)
    for peer in peers.values():
        peer.correct(frame)
    assert estimator_peers.difference(peers["numpy-batch"], peers["filterpy"]) < 1e-9


@pytest.mark.parametrize("late_ms", [0, 120])
def test_the_path_explains_every_observation(late_ms):
    team = team_of(minimal_parameters(4))
    arrivals = estimator_path.flight(team, 200, late_ms, True, np.random.default_rng(1))
    assert [at for at, *_ in arrivals] == sorted(at for at, *_ in arrivals)
    path, seen = estimator_path.Path(team), []
    for now_ns, arrived in estimator_path.ticks(arrivals):
        path.tick(arrived, now_ns)
        seen += path.innovations
    observations = sum(key.topic.name == "observation" for _, key, _, _ in arrivals)
    assert len(seen) == observations
    observer = json.loads(seen[-1])["observer"]
    last = codec.decode(keys.Key("lab", observer, INNOVATION, "tracker"), seen[-1])
    assert isinstance(last, Innovation)
    assert last.verdict is Verdict.ACCEPTED
    assert last.latency_ms >= late_ms
    assert path.filter.belief().layout.robots == team.robots


def test_the_command_reports_rows_and_agreement():
    arguments = ["--robots", "3", "--rounds", "2", "--flight-ms", "200", "--json"]
    result = CliRunner().invoke(bench_estimator.estimator, arguments)
    assert result.exception is None or result.exit_code == 0, result.output
    found = json.loads(result.stdout)
    assert {row["method"] for row in found["kernels"]} == {"ours", "numpy", "numpy-batch", "filterpy"}
    assert [row["delay_ms"] for row in found["path"]] == [0, 120] * 3
    assert all(row["joined"] == row["entities"] for row in found["path"])
    assert found["targets"] == {}, "only 30 robots are judged"


def test_every_filter_is_timed_equally_often(monkeypatch):
    """The minimum of many times is smaller than that of a few: a peer timed less often would seem slower."""
    timed: list[int] = []
    monkeypatch.setattr(estimator_bench.LeastTime, "add", lambda row, *_: timed.append(id(row)))
    with np.errstate(invalid="ignore"):
        estimator_bench._kernel_rows(team_of(minimal_parameters(3)), True, rounds=30, seed=1)
    assert {timed.count(row) for row in set(timed)} == {30}
    assert len(set(timed)) == 4


def test_the_path_of_blocks_as_flown_is_judged_on_its_own():
    kernels = [{"robots": 30, "blocks": "minimal", "method": "ours", "predict_us": 1.0, "correct_us": 1.0}]
    about: Row = {"robots": 30, "heights": False, "to_in_order": 1.0, "delay_ms": 0, "us_per_observation": 59.0}
    late: Row = {"delay_ms": 120}
    flown: Row = {"blocks": "product"}
    heights: Row = {"heights": True, "us_per_observation": 61.0}
    paths = [about | {"blocks": "minimal"}, about | {"blocks": "minimal"} | late, about | flown, about | flown | late]
    paths += [about | flown | heights, about | flown | heights | late]
    found = estimator_bench.targets({"kernels": kernels, "path": paths})
    met = {name: target["met"] for name, target in found.items() if name.startswith("path")}
    assert met == {"path_us_per_observation": True, "path_as_flown_us": True, "path_as_flown_heights_us": False}


def test_without_filterpy_the_rest_is_timed_and_the_remedy_named(monkeypatch):
    monkeypatch.setattr(estimator_peers, "find_spec", lambda name: None)
    result = CliRunner().invoke(bench_estimator.estimator, ["--robots", "2", "--rounds", "2", "--flight-ms", "200"])
    assert "pip install" in result.stdout
    assert "numpy" in result.stdout


@pytest.mark.parametrize("robots", ["", "one", "1", "5,400"])
def test_robots_that_cannot_be_timed_are_refused(robots):
    result = CliRunner().invoke(bench_estimator.estimator, ["--robots", robots])
    assert result.exit_code == 2
    assert "--robots" in result.output
