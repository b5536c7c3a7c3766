"""Today's tracker repeats a real flight of real processes, equal to the bit."""

import json
import subprocess
import sys
from collections.abc import Callable
from typing import Any

import pytest

pytestmark = [pytest.mark.sitl, pytest.mark.slow, pytest.mark.timeout(300)]
Start = Callable[..., "SitlRun"]  # type: ignore[name-defined]  # noqa: F821 - the class lives in conftest.py


def verdict_of(run: "SitlRun") -> tuple[int, dict[str, Any], str]:  # type: ignore[name-defined]  # noqa: F821
    """Fly to the end and re-run it; returns exit code, verdict and output."""
    run.wait(150)
    command = [sys.executable, "-m", "groundstation", "replay", str(run.run_dir), "--recompute"]
    done = subprocess.run([*command, "--json"], capture_output=True, text=True, timeout=120, check=False)
    printed = done.stdout + done.stderr
    assert done.stdout, printed
    return done.returncode, json.loads(done.stdout), printed


def test_a_recorded_flight_is_repeated_to_the_bit(sitl: Start) -> None:
    code, said, printed = verdict_of(sitl("--duration", "5"))
    assert code == 0, printed
    assert said["identical"] and not said["foreign"]
    compared = said["comparison"]
    assert compared["ticks"] > 500 and compared["plans"] > 50 and compared["lives"] == 1
    assert compared["same"]["estimate"] >= 0.99 * compared["ticks"]
