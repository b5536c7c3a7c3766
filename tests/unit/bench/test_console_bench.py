"""The console's bench measures the real process and judges by its limits."""

import json
from typing import Any

import pytest
from click.testing import CliRunner

from groundstation.cli.bench_console import console
from groundstation.cli.bench_limits import judge
from groundstation.cli.exits import ExitCode


def test_a_figure_beyond_its_limit_is_named(capsys: pytest.CaptureFixture[str]) -> None:
    figures: dict[str, Any] = {"cpu": 3.0, "delay": {"median": 70.0, "p99": 1.0}}
    assert judge(figures, {"cpu": 5.0, "delay": 60.0, "not_measured": 1.0}, "median", False) is ExitCode.FAILED
    assert "missed: delay; not measured: not_measured\n" in capsys.readouterr().out
    assert judge(figures, {"cpu": 5.0, "delay": 60.0}, "p99", True) is ExitCode.OK
    assert json.loads(capsys.readouterr().out).items() >= {"passed": True, "not_measured": []}.items()
    assert judge({"cpu": float("nan")}, {"cpu": 5.0}, "median", True) is ExitCode.FAILED


@pytest.mark.slow
@pytest.mark.exhaustive
def test_it_sees_what_the_team_says() -> None:
    result = CliRunner().invoke(console, ["--seconds", "4", "--no-browser", "--json"], standalone_mode=False)
    assert result.exception is None, result.exception
    figures = json.loads(result.stdout)
    assert 5.0 < figures["frames_per_s"] < 21.0  # 20, where nothing else runs
    assert 0.0 < figures["pictures_per_s"] < 11.0
    assert figures["kbyte_per_s"] > 50.0
    assert figures["cpu_percent_of_core"] > 0.0 < figures["peer"]["cpu_percent_of_core"]
    assert "estimate_to_drawn_ms" not in figures
