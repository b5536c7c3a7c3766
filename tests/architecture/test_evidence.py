"""Tests that need real data: skipped with the reason on a machine without them, failed where CI is set."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
NEEDS_DATA = "tests/contract/test_ardrone_pave.py::test_real_capture_has_five_h264_frames"


@pytest.mark.parametrize(("ci", "verdict"), [("", "1 skipped"), ("true", "1 error")])
def test_absent_data_are_named(ci: str, verdict: str, tmp_path: Path) -> None:
    command = [sys.executable, "-m", "pytest", "-p", "no:cacheprovider", NEEDS_DATA]
    environment = {**os.environ, "CI": ci, "GROUNDSTATION_DATA": str(tmp_path)}
    done = subprocess.run(command, cwd=ROOT, env=environment, capture_output=True, text=True, timeout=100, check=False)
    assert verdict in done.stdout and f"no {tmp_path}" in done.stdout and "GROUNDSTATION_DATA" in done.stdout
    assert done.returncode == (1 if ci else 0)


def test_one_place_looks_for_real_data() -> None:
    """A test that looks for recordings by itself could also skip by itself."""
    allowed = {
        Path("tests/conftest.py"),
        Path(__file__).relative_to(ROOT),
        Path("tests/unit/estimation/test_estimation_examples.py"),
    }
    found = {
        path.relative_to(ROOT)
        for path in (ROOT / "tests").rglob("*.py")
        if "GROUNDSTATION_DATA" in path.read_text(encoding="utf-8")
    }
    assert found <= allowed, found - allowed
