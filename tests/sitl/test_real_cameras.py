"""`sitl --real` with a real world-fixed camera: alone, above a real drone, and in front of a printed board."""

import signal
import sys
from collections.abc import Callable
from pathlib import Path

import msgspec
import numpy as np
import pytest

from groundstation.bus.messages import Estimate, RelativeObservation
from groundstation.bus.topics import ESTIMATE, OBSERVATION
from groundstation.recording.reader import open_recording
from groundstation.settings.load import load_field
from groundstation.settings.resolved import resolved_field
from sim_bridge.cameras import render_specs
from sim_bridge.render.renderer import Renderer
from sim_bridge.scenario import Scenario
from sim_bridge.site import parse_site

sys.path.insert(0, str(Path(__file__).parent))  # for the helper modules of this folder
from mjpeg import camera
from real_parts import PAD_M, PAD_YAW_RAD, ROOT, STAND_IN, Run, field, places, stand_in, started, true_poses

__all__ = ["stand_in", "started"]  # fixtures
pytestmark = [pytest.mark.slow, pytest.mark.sitl, pytest.mark.exhaustive, pytest.mark.timeout(400)]
FPS, DELAY_S = 6.0, 0.12
FENCE_M = (3.7, 2.7)
# The emulated partner is in view of the emulated ceiling_east.
SMALL_TEAM = ("--set", "drones.drone_3=null", "--set", "drones.drone_1.pad_m=[0.6,0.5]")
Row = np.ndarray


class Ceiling:
    """The observations of drone_2 alone by ceiling_west, at any pose in `row` (of the truth board)."""

    def __init__(self, row: Callable[[], Row | None]) -> None:
        site = parse_site(msgspec.to_builtins(resolved_field(load_field(ROOT / "config" / "mixed-team.yaml"))))
        (spec,) = render_specs(site, Scenario(), {"ceiling_west": ("", 0)}, "", 1)
        self._renderer, self._row, self._place = Renderer(spec), row, site.bodies.index("drone_2")
        self._states = np.full((len(site.bodies), 13), np.nan)

    def picture(self) -> np.ndarray:
        if (row := self._row()) is not None:
            self._states[self._place] = row
        return self._renderer.render(self._states)


def test_emulated_drones_fly_beside_a_real_ceiling_camera(tmp_path: Path, started: Callable[..., Run]) -> None:
    with camera(lambda: np.full((720, 1280), 110, np.uint8), 15.0) as source:
        path = field(tmp_path, "flavour: px4, system_id: 11", of_50=source)
        run = started(path, "--real", "ceiling_west", "--duration", "15")
        run.process.wait(240)
        assert "ceiling_west is real and does not see what is emulated" in run.said
        assert f"pictures from {source}" in run.said, run.said
        assert run.report()["landed"], run.said


@pytest.mark.usefixtures("stand_in")
def test_a_real_drone_below_a_real_ceiling_camera_chases_an_emulated_target(
    tmp_path: Path, started: Callable[..., Run]
) -> None:
    """The station has only the drone's telemetry and its observations by the camera."""
    truth = true_poses()

    def row() -> Row | None:
        pose = truth.latest(0)
        return pose and np.array([*pose.position, *pose.velocity, *pose.attitude, *pose.rates, 0.0])

    try:
        with camera(Ceiling(row).picture, FPS, DELAY_S) as source:
            path = field(tmp_path, "flavour: ardupilot, system_id: 1", STAND_IN, of_50=source)
            run = started(path, "--real", "drone_2", "--real", "ceiling_west", "--duration", "12", *SMALL_TEAM)
            run.until("To take off and track press Enter", 120)
            run.press_enter()
            run.until("drone_2: TRACK sent / received / accepted / effective", 90)
            run.process.wait(90)
            flown = places(tmp_path)
            assert max(z for _, _, z in flown) > 0.5 and flown[-1][2] < 0.1
            assert max(abs(x) - FENCE_M[0] for x, _, _ in flown) < 0.0
            assert "all drones have landed" in run.said, "the report knows no truth of the real one"
            assert run.report()["target_rmse_m"] <= 0.15, run.said
            assert "the room takes it to be where the tracker says" in run.said
    finally:
        truth.close()


def test_a_printed_board_is_seen_by_the_camera_and_flies_nowhere(tmp_path: Path, started: Callable[..., Run]) -> None:
    """A drone that never answers is no robot of the belief: its board shows the camera's raw observations."""
    board = np.array([*PAD_M, 0.06, *[0.0] * 5, PAD_YAW_RAD, *[0.0] * 3, 1.0])
    with camera(Ceiling(lambda: board).picture, FPS, DELAY_S) as source:
        path = field(tmp_path, "flavour: px4, system_id: 11", "127.95.1.3", of_50=source)
        run = started(path, "--real", "drone_2", "--real", "ceiling_west", *SMALL_TEAM)
        run.until("To take off and track press Enter", 120)
        run.process.send_signal(signal.SIGINT)
        run.process.wait(60)
    seen, believed = [], set()
    for record in open_recording(run.run_folder / "state.mcap").records(lambda t: t in (OBSERVATION, ESTIMATE)):
        match record.message:
            case RelativeObservation(subject="drone_2", observer="ceiling_west") as sighting:
                seen.append(sighting.position_m)
            case Estimate() as estimate:
                believed |= {entity.name for entity in estimate.entities}
    assert len(seen) > 3 and "drone_2" not in believed
    # The ceiling camera is at (-1.7, 0, 4.2); the marker 0.14 m above the floor. Optical: right, down, forward.
    assert np.median(seen, axis=0) == pytest.approx((PAD_M[0] + 1.7, -PAD_M[1], 4.06), abs=0.12)
