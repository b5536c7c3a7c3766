"""A target's odometry at the wire: healthy, silent, frozen and wrong, while the cameras continue."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from scenario_faults import faults, until_the_first_fault

pytestmark = [pytest.mark.sitl, pytest.mark.slow, pytest.mark.exhaustive, pytest.mark.timeout(240)]
Start = Callable[..., Any]
HEARD = ("--set", "target.odometry.source=ros2://192.168.1.20/odom")
NOT_BELIEVED = "turtlebot reports another motion than cameras see"


def test_each_way_in_which_it_breaks_is_told_and_the_team_tracks_on(sitl: Start, tmp_path: Path) -> None:
    scenario = faults(
        tmp_path,
        "kind: odometry_silent, entity: turtlebot, start_s: 24, end_s: 27",
        "kind: odometry_frozen, entity: turtlebot, start_s: 30, end_s: 33",
        "kind: odometry_scaled, entity: turtlebot, value: 0, start_s: 36, end_s: 46",
    )
    run = sitl("sitl", "lab", *HEARD, "--duration", "35", "--scenario", scenario)
    tracking, _ = until_the_first_fault(run, "odometry_silent")
    run.until(lambda: any("odometry_scaled" in text and "ends" in text for text in run.events()), 60, "the last fault")
    told = run.events()
    for name in run.record.drones:
        assert set(run.modes_since(name, tracking)) == {"TRACK"}, run.text
    assert run.wait(90) in (0, 1), run.text  # 1: the simulator's ticks were late on a busy machine
    assert any("no report for" in text for text in told) and any("hangs" in text for text in told), told
    assert any(NOT_BELIEVED in text for text in told), told
    report = dict(json.loads((run.run_dir / "report.json").read_text()))
    assert report["landed"] and report["max_fence_violation_m"] == 0.0
    assert report["target_rmse_m"] <= 0.1, run.text
