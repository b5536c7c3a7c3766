"""Unmodified firmware as one drone of the team, in step with the room: how well it holds, and how it ends.

`make test-firmware`; a skip where the variable of a firmware names no binary. One flight each: figures of more are in
docs/reference/mavlink.md 2.1.
"""

import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))  # what lies here and is no test belongs to these tests
from firmware import VARIABLES, binary_of
from firmware_flight import fly

pytestmark = [pytest.mark.slow, pytest.mark.firmware, pytest.mark.timeout(800)]
TAKE_OFF_M = 0.8


@pytest.mark.parametrize(("seed", "fault"), [(1, "dark"), (2, "guarded")])
@pytest.mark.parametrize("flavour", ["px4", "ardupilot"])
def test_a_firmware_tracks_with_the_team_and_stops_near_without_cameras_or_driver(
    flavour: str, seed: int, fault: str, tmp_path: Path
) -> None:
    if not binary_of(flavour):
        pytest.skip(f"{VARIABLES[flavour]} names no SITL binary: none is in a package registry")
    figures = fly(flavour, seed, 30.0, tmp_path, fault)
    assert figures["height_m"] == pytest.approx(TAKE_OFF_M, rel=0.1), figures
    assert figures["drift_m"] <= 0.25, figures
    assert figures["left"] == "" and figures["target_rmse_m"] <= 0.05, figures
    assert figures["belief_max_m"] <= 0.15, figures
    assert figures["ends"] in ("floor", "rest") and figures["farthest_m"] <= 1.5, figures
