"""Cameras of a study expose at their own rates, one after the other."""

import itertools
from types import SimpleNamespace

from sim_bridge.study.exposures import Exposures
from sim_bridge.world.world import TICK_S

SECONDS = 4


def test_each_camera_exposes_at_its_rate_and_none_at_the_same_tick() -> None:
    cameras = [SimpleNamespace(name=name, period_s=1 / 15) for name in ("ceiling", "drone_1", "drone_2")]
    exposures = Exposures(cameras)
    ticks = [[camera.name for camera in exposures.due(k * TICK_S)] for k in range(1, round(SECONDS / TICK_S) + 1)]
    assert max(map(len, ticks)) == 1
    for camera in cameras:
        at = [k for k, names in enumerate(ticks) if camera.name in names]
        assert abs(len(at) - 15 * SECONDS) <= 1
        assert all(abs((b - a) * TICK_S - camera.period_s) <= TICK_S for a, b in itertools.pairwise(at))
