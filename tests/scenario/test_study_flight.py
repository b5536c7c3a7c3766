"""A flight at message level: honest sensors, the tracker, the planner, a manual clock."""

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from groundstation.bus.messages import Message, RelativeObservation
from groundstation.field.resolved import ResolvedField
from groundstation.settings.load import load_field
from groundstation.settings.resolved import resolved_field
from groundstation.settings.scenario import load_scenario
from sim_bridge.scenario import Scenario, parse_scenario
from sim_bridge.study.runner import Study, StudyOptions

ROOT = Path(__file__).parents[2]


@pytest.fixture(scope="module")
def flight(lab_field: ResolvedField) -> dict[str, Any]:
    return Study(lab_field, Scenario(), StudyOptions(seed=3, duration_s=25.0)).run()


def test_the_target_is_found_and_held(flight: dict[str, Any]) -> None:
    assert flight["target_rmse_m"] <= 0.30  # the first seconds count as 1 m until it is found
    assert flight["robot_rmse_m"]["turtlebot"] <= 0.12
    assert flight["target_lost_s"] <= 3.0
    assert flight["max_fence_violation_m"] == 0.0
    assert flight["min_separation_m"] >= 0.6


def test_robots_know_where_they_are(flight: dict[str, Any]) -> None:
    assert max(flight["robot_rmse_m"][name] for name in ("drone_1", "drone_2")) <= 0.10
    assert flight["verdicts"].get("IMPLAUSIBLE", 0) == 0
    assert flight["verdicts"].get("LATE", 0) == 0


def test_the_same_seed_gives_the_same_flight(lab_field: ResolvedField) -> None:
    reports = [Study(lab_field, Scenario(), StudyOptions(seed=5, duration_s=2.0)).run() for _ in range(2)]
    for report in reports:
        report.pop("cpu_s")
    assert reports[0] == reports[1]


@pytest.mark.slow
@pytest.mark.study
def test_grossly_wrong_sightings_do_no_harm(lab_field: ResolvedField) -> None:
    report = Study(lab_field, Scenario(), StudyOptions(seed=3, duration_s=15.0, outliers=0.02)).run()
    assert report["verdicts"]["IMPLAUSIBLE"] > 0
    assert max(report["robot_rmse_m"][name] for name in ("drone_1", "drone_2")) <= 0.12


@pytest.mark.slow
@pytest.mark.study
def test_two_targets_are_found_and_held() -> None:
    scenario = parse_scenario(json.dumps(load_scenario(ROOT / "config/scenarios/two-targets.yaml")))
    field = resolved_field(load_field(ROOT / "config/two-targets.yaml"))
    report = Study(field, scenario, StudyOptions(seed=1, duration_s=15.0)).run()
    for name, target in report["targets"].items():
        assert target["lost_s"] <= 4.0, name  # until it is found
        assert report["robot_rmse_m"][name] <= 0.12, name
    assert report["target_rmse_m"] == max(target["rmse_m"] for target in report["targets"].values())
    assert report["min_separation_m"] >= 0.6


def test_the_command_line_prints_json() -> None:
    command = [sys.executable, "-m", "sim_bridge.study", "demo", "--seed", "2", "--duration", "1", "--json"]
    result = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=110, check=False)
    assert result.returncode == 0, result.stderr
    assert json.loads(result.stdout)["seed"] == 2


def test_a_wrong_field_is_reported_as_the_command_line_does() -> None:
    command = [sys.executable, "-m", "sim_bridge.study", "demo", "--set", "planner.horizn_steps=3"]
    result = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=60, check=False)
    assert result.returncode == 2
    assert "horizn_steps" in result.stderr


class Dated(Study):
    """Records how much later than its stamp each observation arrives [ms]."""

    late_ms: list[float]

    def _send(self, arrival_ns: int, key: str, message: Message) -> None:
        if isinstance(message, RelativeObservation):
            self.late_ms.append((arrival_ns - message.header.stamp_ns) / 1e6)
        super()._send(arrival_ns, key, message)


@pytest.mark.parametrize("late_ms", [120.0, 200.0])
def test_a_video_that_is_later_than_its_setting_is_dated_by_the_setting(
    lab_field: ResolvedField, late_ms: float
) -> None:
    """As a camera's driver does: it knows a picture's arrival time, and its configured delay."""
    cameras = Scenario().cameras.model_copy(update={"video_delay_ms": late_ms})
    study = Dated(lab_field, Scenario().model_copy(update={"cameras": cameras}), StudyOptions(seed=1, duration_s=0.5))
    study.late_ms = []
    study.run()
    told_ms = lab_field.cameras["ceiling"].video_delay_ms
    assert study.late_ms and all(told_ms + 9.9 <= late <= told_ms + 50.1 for late in study.late_ms)
