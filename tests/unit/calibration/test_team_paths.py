"""Trajectories of the batch: interpolation between two knots is independent of delays and of picture times."""

import numpy as np
import pytest

from groundstation.calibration.team_paths import RobotPath, grid_of
from groundstation.calibration.team_record import OwnMotion
from groundstation.field.resolved import ResolvedField

SECONDS = 20.0


def shaken(seed: int = 1) -> OwnMotion:
    """Return a drone at rest whose velocities are noise."""
    times = np.arange(0.0, SECONDS, 0.01)
    still = np.zeros(len(times))
    velocities = 0.05 * np.random.default_rng(seed).standard_normal((len(times), 2))
    return OwnMotion(times, velocities, still, still, still, still, still, still, still)


def test_a_suspected_delay_moves_the_knots_and_not_the_way_between_them(lab_field: ResolvedField) -> None:
    grid = grid_of(SECONDS)
    path = RobotPath(shaken(), lab_field.drones["drone_1"], grid, np.zeros((len(grid.times), 6)))
    middle = grid.times[5:-5] + 0.5 * grid.spacing_s
    between, at_knots = path.bulge(middle), path.at_knots
    assert np.std(between) > 3e-4, "the noise of velocities is most of it"
    path.refresh(0.1, 0.1, 0.0, 0.05)
    assert np.array_equal(path.bulge(middle), between)
    assert not np.allclose(path.at_knots, at_knots, atol=1e-3)


def test_the_way_between_two_knots_turns_with_the_heading(lab_field: ResolvedField) -> None:
    grid = grid_of(SECONDS)
    path = RobotPath(shaken(), lab_field.drones["drone_1"], grid, np.zeros((len(grid.times), 6)))
    middle = grid.times[5:-5] + 0.5 * grid.spacing_s
    before = path.bulge(middle)
    path.knots[:, 3] = np.pi / 2.0
    path.refresh(0.0, 0.0, 0.0, 0.0)
    assert path.bulge(middle) == pytest.approx(np.column_stack((-before[:, 1], before[:, 0])), abs=1e-12)


@pytest.mark.parametrize("rate_hz", [5.0, 10.0, 12.5, 15.0, 20.0, 25.0, 30.0, 50.0, 60.0])
def test_pictures_of_every_usual_rate_lie_everywhere_between_knots(rate_hz: float) -> None:
    _, share = grid_of(SECONDS).between(np.arange(0.0, SECONDS, 1.0 / rate_hz))
    counts = np.histogram(share, bins=8, range=(0.0, 1.0))[0]
    assert counts.min() > 0.5 * counts.mean()


def test_knots_may_begin_before_a_recording_and_reach_its_end() -> None:
    grid, moved = grid_of(SECONDS), grid_of(SECONDS, 0.5)
    assert grid.times[0] == 0.0 and moved.times[0] == -0.5 * grid.spacing_s
    assert min(grid.times[-1], moved.times[-1]) >= SECONDS
