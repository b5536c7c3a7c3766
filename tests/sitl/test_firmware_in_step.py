"""Unmodified firmware as one drone of the team, in step with the room: accuracy of position, and end of flight.

`make test-firmware`; a skip where the variable of a firmware names no binary. One flight each: figures of more are in
docs/reference/mavlink.md 2.1.
"""

import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))  # for the helper modules of this folder
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
    team = fly([flavour], seed, 30.0, tmp_path, fault)
    (one,) = team["firmwares"]
    assert one["height_m"] == pytest.approx(TAKE_OFF_M, rel=0.1), team
    assert one["drift_m"] <= 0.25, team
    assert one["left"] == "" and team["target_rmse_m"] <= 0.05, team
    assert one["belief_max_m"] <= 0.15, team
    assert one["ends"] in ("floor", "rest") and one["farthest_m"] <= 1.5, team


def test_both_firmwares_track_together_with_an_emulated_drone(tmp_path: Path) -> None:
    for flavour, variable in VARIABLES.items():
        if not binary_of(flavour):
            pytest.skip(f"{variable} names no SITL binary: none is in a package registry")
    team = fly(["px4", "ardupilot"], 3, 30.0, tmp_path)
    assert team["tracked_s"] >= 30.0 and team["target_rmse_m"] <= 0.05, team
    assert max(one["belief_max_m"] for one in team["firmwares"]) <= 0.15, team
