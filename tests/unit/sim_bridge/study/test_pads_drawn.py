"""Random pads and paths of a campaign: apart and within the fence, for every seed and every team that fits there."""

import math
from itertools import combinations
from typing import Any

import pytest

from sim_bridge.scenario import Scenario
from sim_bridge.study.faults.draw import draw
from sim_bridge.study.faults.flight_order import WrongOrder
from sim_bridge.target_paths import FigureEight

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


@pytest.mark.slow
@pytest.mark.study
@pytest.mark.timeout(60)
def test_a_team_that_has_no_room_before_the_camera_is_refused() -> None:
    team = {f"drone_{number}": {"kind": "ardrone"} for number in range(20)}
    with pytest.raises(WrongOrder, match=r"20 drones: pads .*: fly fewer, or widen room\.fence$"):
        draw({**FIELD, "drones": team}, Scenario(), 1, (11.0, 20.0))


@pytest.mark.parametrize(
    ("x_m", "y_m"), [((-1.0, 1.0), (-1.0, 1.0)), ((-1.2, 1.2), (-1.2, 1.2)), ((0.5, 4.5), (-4.0, -1.0))]
)
def test_pads_and_path_lie_within_the_fence(x_m: tuple[float, float], y_m: tuple[float, float]) -> None:
    field = fenced(x_m, y_m)
    for seed in range(200):
        drawn = draw(field, Scenario(), seed, (11.0, 20.0))
        for x, y in (drone["pad_m"] for drone in drawn.field["drones"].values()):
            assert x_m[0] + 0.299 < x < x_m[1] - 0.299 and y_m[0] + 0.299 < y < y_m[1] - 0.299
        path = drawn.scenario.target.path
        assert isinstance(path, FigureEight)
        (x, y), length, width = path.centre_m, path.half_length_m, path.half_width_m
        assert x_m[0] < x - length < x + length < x_m[1] and y_m[0] < y - width < y + width < y_m[1]


@pytest.mark.parametrize("half_m", [0.2, pytest.param(0.6, marks=(pytest.mark.slow, pytest.mark.study))])
def test_a_fence_without_room_for_pads_is_refused(half_m: float) -> None:
    with pytest.raises(WrongOrder, match=r"2 drones: pads .* widen room\.fence$"):
        draw(fenced((-half_m, half_m), (-half_m, half_m)), Scenario(), 1, (11.0, 20.0))


def fenced(x_m: tuple[float, float], y_m: tuple[float, float]) -> dict[str, Any]:
    drones = {name: {"kind": "ardrone"} for name in ("drone_1", "drone_2")}
    return {**FIELD, "room": {"fence": {"x_m": x_m, "y_m": y_m, "z_m": (0.0, 2.8)}}, "drones": drones}
