"""A body that follows external poses: its motion between them, and when it is absent."""

import math

import numpy as np
import pytest

from sim_bridge.world.puppet import OutsidePose, Puppet
from sim_bridge.world.world import TICK_S


def test_a_pose_beyond_the_walls_is_nowhere() -> None:
    puppet = Puppet((4.0, 3.0, 4.5), TICK_S)
    puppet.follow(OutsidePose((3.9, 0.0, 1.0), (1.0, 0.0, 0.0), (0.0, 0.0, 0.0)))
    assert not puppet.nowhere
    for _ in range(25):
        puppet.step()
    assert "outside of the room" in puppet.nowhere and math.isnan(puppet.row()[0])


def test_a_body_whose_place_is_told_in_grains_moves_evenly() -> None:
    grain_m, speed_m_s, puppet = 0.0111, 0.2, Puppet((4.0, 3.0, 4.5), TICK_S)
    places = []
    for tick in range(400):
        if tick % 4 == 0:
            told_m = grain_m * round(speed_m_s * tick * TICK_S / grain_m)
            puppet.follow(OutsidePose((told_m, 0.0, 1.0), (speed_m_s, 0.0, 0.0), (0.0, 0.0, 0.0), grain_m=grain_m))
        puppet.step()
        places.append(puppet.airframe.x)
    steps = np.diff(places[20:])
    assert steps == pytest.approx(speed_m_s * TICK_S, abs=0.0005)
    assert places[-1] == pytest.approx(speed_m_s * 400 * TICK_S, abs=grain_m)
