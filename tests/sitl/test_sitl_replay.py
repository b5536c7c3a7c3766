"""A real flight of real processes, repeated by today's tracker: every word of it to the bit."""

import json
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

pytestmark = [pytest.mark.sitl, pytest.mark.slow, pytest.mark.timeout(300)]
Start = Callable[..., "SitlRun"]  # type: ignore[name-defined]  # noqa: F821 - the class lives in conftest.py


def test_a_recorded_flight_is_repeated_to_the_bit(sitl: Start, tmp_path: Path) -> None:
    run = sitl("--duration", "5")
    run.wait(150)
    verdict = tmp_path / "verdict.json"
    command = [sys.executable, "-m", "groundstation.cli.main", "replay", str(run.run_dir), "--rerun", "tracker"]
    done = subprocess.run([*command, "--json", str(verdict)], capture_output=True, text=True, timeout=120, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    said = json.loads(verdict.read_text())
    assert said["identical"] and not said["foreign"]
    compared = said["comparison"]
    assert compared["ticks"] > 500 and compared["plans"] > 50 and compared["lives"] == 1
    assert compared["same"]["estimate"] >= 0.99 * compared["ticks"]
