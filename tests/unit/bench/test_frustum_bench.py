"""The bench of the planner used in flight: its simulated team, and the rows of its table."""

import itertools

import numpy as np

from groundstation.bench.frustum import run_frustum_bench
from groundstation.bench.frustum_team import TARGET, FrustumTeam, settled


def test_a_team_in_flight_knows_its_target_better_than_a_fresh_one() -> None:
    team, fresh = settled(3, "two-level", 3, 1.5), FrustumTeam(3, "two-level", 3)
    assert np.linalg.eigvalsh(team.belief.covariance)[0] > 0.0
    assert team.belief.covariance_of(TARGET)[2, 2] < fresh.belief.covariance_of(TARGET)[2, 2]
    assert team.plan is not None and set(team.plan.controls) == set(team.names)


def test_each_team_has_a_row_for_fresh_and_for_running_beliefs() -> None:
    rows = run_frustum_bench([2], ["flat"], repeats=2, running_s=0.2)["rows"]
    assert [(row["robots"], row["belief"]) for row in rows] == [(2, "fresh"), (2, "running")]
    assert all(row["topologies"] == 3 and row["evaluations"] > 10 and 0.0 <= row["gap"] <= 1.0 for row in rows)


def test_thirty_robots_have_a_plan_as_soon_as_they_must_and_the_time_is_asked_for_often() -> None:
    team = FrustumTeam(30, "two-level", 3)
    asked = itertools.count()
    hasty = team.planner.plan(team.belief, team.topology, None, lambda: next(asked) >= 0)
    assert (hasty.solver.status, hasty.solver.evaluations, next(asked)) == ("stopped", 1, 1)
    assert set(hasty.controls) == set(team.names)

    asked = itertools.count()
    later = team.planner.plan(team.belief, team.topology, None, lambda: next(asked) >= 40)
    assert later.solver.evaluations <= 41, "one evaluation between two questions"
    again = team.planner.plan(team.belief, team.topology, None, lambda: False, later.solver.evaluations)
    assert again.cost == later.cost <= hasty.cost
