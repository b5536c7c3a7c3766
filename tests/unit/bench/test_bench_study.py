"""`groundstation bench study` takes the quickest flight and compares it with 40 times real time."""

import json
from typing import Any

import pytest
from click.testing import CliRunner

from groundstation.cli import bench_study
from groundstation.errors import GroundStationError


def flight(world_s: float, filter_s: float) -> dict[str, Any]:
    return {"flown_s": 50.0, "cpu_s": {"world": world_s, "filter": filter_s, "total": world_s + filter_s}}


@pytest.mark.parametrize(("quickest_s", "passed"), [(2.0, False), (1.0, True)])
def test_the_quickest_flight_counts(monkeypatch: pytest.MonkeyPatch, quickest_s: float, passed: bool) -> None:
    flights = iter([flight(0.1, 0.1), flight(2.0, 1.0), flight(0.5, quickest_s - 0.5), flight(4.0, 1.0)])
    monkeypatch.setattr(bench_study, "_fly", lambda _seconds: next(flights))
    result = CliRunner().invoke(bench_study.study, ["--runs", "3", "--json"], standalone_mode=False)
    figures = json.loads(result.output)
    assert figures["times_real_time"] == 50.0 / quickest_s
    assert figures["cpu_ms_per_flight_s"]["total"] == 1e3 * quickest_s / 50.0
    assert figures["cpu_ms_per_flight_s"]["world"] == 10.0
    assert figures["passed"] is passed


def test_a_study_that_fails_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sys.executable", "/bin/false")
    with pytest.raises(GroundStationError, match="exit code 1"):
        bench_study._fly(1.0)
