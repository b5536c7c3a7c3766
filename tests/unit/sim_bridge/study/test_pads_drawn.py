"""Random pads of a campaign: apart, for every seed, and for every team that fits in the camera's view."""

import math
from itertools import combinations
from typing import Any

import pytest

from sim_bridge.scenario import Scenario
from sim_bridge.study.faults.draw import draw
from sim_bridge.study.faults.flight_order import WrongOrder

FIELD: dict[str, Any] = {
    "room": {"fence": {"x_m": (-3.7, 3.7), "y_m": (-2.7, 2.7), "z_m": (0.0, 2.8)}},
    "cameras": {"ceiling": {}},
}


@pytest.mark.timeout(60)
@pytest.mark.parametrize(("drones", "seed"), [(3, 683), (4, 39)])
def test_pads_that_leave_no_room_for_another_are_drawn_anew(drones: int, seed: int) -> None:
    """Two well-placed pads cover the whole floor before the camera: the campaign searched for a third for ever."""
    team = {f"drone_{number}": {"kind": "ardrone"} for number in range(drones)}
    flown = draw({**FIELD, "drones": team}, Scenario(), seed, (11.0, 20.0))
    pads = [drone["pad_m"] for drone in flown.field["drones"].values()]
    assert len(pads) == drones and min(math.dist(a, b) for a, b in combinations(pads, 2)) >= 1.1


@pytest.mark.timeout(60)
def test_a_team_that_has_no_room_before_the_camera_is_refused() -> None:
    team = {f"drone_{number}": {"kind": "ardrone"} for number in range(20)}
    with pytest.raises(WrongOrder, match="20 drones: pads"):
        draw({**FIELD, "drones": team}, Scenario(), 1, (11.0, 20.0))
