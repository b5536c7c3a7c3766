"""Cameras of a study expose at their own rates, one after the other."""

import itertools
from types import SimpleNamespace

import pytest

from sim_bridge.study.exposures import Exposures
from sim_bridge.world.world import TICK_S

SECONDS = 60


def exposed_at(fps, names=("ceiling", "drone_1", "drone_2")):
    """Return the ticks at which each camera exposed."""
    cameras = [SimpleNamespace(name=name, period_s=1 / fps) for name in names]
    exposures = Exposures(cameras)
    at: dict[str, list[int]] = {name: [] for name in names}
    for tick in range(1, round(SECONDS / TICK_S) + 1):
        for camera in exposures.due(tick * TICK_S):
            at[camera.name].append(tick)
    return at


@pytest.mark.parametrize("fps", [10, 15, 20, 50, 100])
def test_each_camera_exposes_at_its_rate(fps):
    of_each = exposed_at(fps).values()
    assert [abs(len(at) - fps * SECONDS) <= 1 for at in of_each] == [True] * 3
    tolerance_s = 1e-9 if (1 / fps / TICK_S) % 1 < 1e-9 else TICK_S
    gaps_s = {(b - a) * TICK_S for at in of_each for a, b in itertools.pairwise(at)}
    assert max(abs(gap_s - 1 / fps) for gap_s in gaps_s) <= tolerance_s


def test_no_two_cameras_expose_at_the_same_tick():
    ticks = [tick for at in exposed_at(15).values() for tick in at]
    assert len(ticks) == len(set(ticks))
