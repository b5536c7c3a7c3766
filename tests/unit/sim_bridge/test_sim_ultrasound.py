"""Drones near each other disturb each other's ultrasound unless they are set to different rates."""

import numpy as np
import pytest

from sim_bridge.scenario import DroneScenario, Scenario
from sim_bridge.site import Site
from sim_bridge.world.ardrone import Quadrotor
from sim_bridge.world.world import World


def fly(apart_m: float, codes: tuple[int, int], crosstalk: bool = True) -> tuple[np.ndarray, np.ndarray, int]:
    """Return error of the fused height, error of the echo [m] and the rejected echoes of two hovering drones."""
    marker = {"code": 1, "square_mm": 44, "position_m": [0, 0, 0.08]}
    drones = {name: {"kind": "ardrone", "pad_m": (x, 0), "marker": marker} for name, x in (("a", 0), ("b", apart_m))}
    site = Site.model_validate(
        {
            "site": "lab",
            "room": {"size_m": [12, 12, 4.5]},
            "drones": drones,
            "target": {"name": "t", "marker": {"code": 5, "height_m": 0.4, "square_mm": 44}},
        }
    )
    world = World(site, Scenario(drones=DroneScenario(ultrasound_crosstalk=crosstalk)), 3)
    for drone, code in zip(world.of(Quadrotor).values(), codes, strict=True):
        drone.ultrasound_code = code
        drone.autopilot.take_off()
    fused, echoes, rejected = [], [], 0
    for tick in range(4000):
        world.step()
        if tick > 1500 and tick % 3 == 0:
            z, onboard = world.drones["a"].airframe.z, world.onboard["a"]
            fused.append(onboard.height - z)
            echoes.append(onboard.echo - z)
            rejected += onboard.rejected > 0
    return np.array(fused), np.array(echoes), rejected


def test_the_same_rate_disturbs_and_the_filter_holds_most_of_it_off() -> None:
    fused, echoes, rejected = fly(1.0, (8, 8))
    assert 0.1 < np.mean(np.abs(echoes) > 0.2) < 0.4, "foreign echoes"
    assert rejected > 50
    assert np.sqrt(np.mean(fused**2)) < 0.06


@pytest.mark.parametrize(("apart_m", "codes"), [(1.0, (7, 8)), (4.0, (8, 8))])
def test_another_rate_or_some_distance_leaves_it_alone(apart_m: float, codes: tuple[int, int]) -> None:
    _, echoes, rejected = fly(apart_m, codes)
    assert rejected == 0
    assert np.abs(echoes).max() < 0.25


def test_a_scenario_can_leave_it_out() -> None:
    assert fly(1.0, (8, 8), crosstalk=False)[2] == 0
