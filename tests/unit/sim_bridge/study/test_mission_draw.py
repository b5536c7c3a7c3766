"""Random missions: rooms with their fence, pads, and targets that stay in the room."""

import msgspec
import pytest

from groundstation.field.resolved import ResolvedField, field_from_json
from sim_bridge.scenario import Scenario
from sim_bridge.site import parse_site
from sim_bridge.study.missions.draw import draw_mission
from sim_bridge.world.world import World

SEEDS = range(1, 61)


@pytest.mark.parametrize("seed", [3, 17])
def test_a_seed_is_one_mission(lab_field: ResolvedField, seed: int) -> None:
    field = msgspec.to_builtins(lab_field)
    assert draw_mission(field, Scenario(), seed) == draw_mission(field, Scenario(), seed)
    assert draw_mission(field, Scenario(), seed) != draw_mission(field, Scenario(), seed + 1)


def test_rooms_hold_their_fence_pads_and_target(lab_field: ResolvedField) -> None:
    field = msgspec.to_builtins(lab_field)
    lengths, shapes = [], set()
    for seed in SEEDS:
        drawn = draw_mission(field, Scenario(), seed)
        room = field_from_json(msgspec.json.encode(drawn.field)).room
        half = (room.size_m[0] / 2, room.size_m[1] / 2)
        assert (room.fence.x_m[1], room.fence.y_m[1]) == pytest.approx((half[0] - 0.3, half[1] - 0.3))
        world = World(parse_site(drawn.field), drawn.scenario, seed)
        for state in world.states():
            assert abs(state[0]) < half[0] and abs(state[1]) < half[1]
        lengths.append(room.size_m[0])
        shapes.add(drawn.scenario.target.path.shape)
    assert min(lengths) < 7.0 and max(lengths) > 11.0
    assert shapes == {"figure_eight", "random_walk", "sprint", "along_walls", "anywhere", "waypoints"}
