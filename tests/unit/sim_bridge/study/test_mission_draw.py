"""Random missions: rooms with their fence, pads, and targets that stay in the room."""

import json

import msgspec
import pytest

from groundstation.field.resolved import ResolvedField, field_from_json
from groundstation.settings.files import find_field
from groundstation.settings.load import load_field
from groundstation.settings.resolved import resolved_field
from groundstation.settings.sections import CAMERA, driver_sections
from sim_bridge.fault_kinds import FaultKind
from sim_bridge.scenario import Scenario
from sim_bridge.site import parse_site
from sim_bridge.study.faults.draw import apart_m
from sim_bridge.study.faults.vehicles import of_team
from sim_bridge.study.missions.draw import draw_mission
from sim_bridge.world.world import World

SEEDS = range(1, 61)


@pytest.mark.parametrize("seed", [3, 17])
def test_a_seed_is_one_mission(lab_field: ResolvedField, seed: int) -> None:
    field = msgspec.to_builtins(lab_field)
    assert draw_mission(field, Scenario(), seed) == draw_mission(field, Scenario(), seed)
    assert draw_mission(field, Scenario(), seed) != draw_mission(field, Scenario(), seed + 1)


def test_drones_drift_in_directions_of_their_own_only_where_asked(lab_field: ResolvedField) -> None:
    field = msgspec.to_builtins(lab_field)
    drawn = draw_mission(field, Scenario(), 4, drift_m_s=0.05)
    assert [(f.kind, f.entity, f.value, f.end_s) for f in drawn.scenario.faults] == [
        (FaultKind.VELOCITY_JUMPING, name, 0.05, None) for name in field["drones"]
    ]
    assert len({fault.direction_deg for fault in drawn.scenario.faults}) == 2
    still = draw_mission(field, Scenario(), 4)
    assert still.scenario.faults == () and still.field == drawn.field


def test_teams_of_two_to_all_drones_fly_with_their_drivers_alone() -> None:
    field = load_field(find_field("mixed-team"), ())
    plain = msgspec.to_builtins(resolved_field(field))
    sections = [(s.kind, s.section) for s in driver_sections(field) if s.kind != CAMERA]
    teams = set()
    for seed in SEEDS:
        drones = draw_mission(plain, Scenario(), seed).field["drones"]
        teams.add(tuple(drones))
        driven = [json.loads(section) for _, section in of_team(sections, drones)]
        assert {v["name"] for section in driven for v in section.get("vehicles", [section])} == set(drones)
    assert {len(team) for team in teams} == {2, 3} and len(teams) == 4


def test_rooms_hold_their_fence_pads_and_target(lab_field: ResolvedField) -> None:
    field = msgspec.to_builtins(lab_field)
    lengths, shapes, pillars = [], set(), 0
    for seed in SEEDS:
        drawn = draw_mission(field, Scenario(), seed)
        room = field_from_json(msgspec.json.encode(drawn.field)).room
        half = (room.size_m[0] / 2, room.size_m[1] / 2)
        assert (room.fence.x_m[1], room.fence.y_m[1]) == pytest.approx((half[0] - 0.3, half[1] - 0.3))
        for pillar in room.obstacles.values():
            pillars += 1
            pads = [drone["pad_m"] for drone in drawn.field["drones"].values()]
            assert min(apart_m(msgspec.to_builtins(pillar), pad) for pad in pads) >= 0.6
            assert room.fence.x_m[0] <= pillar.centre_m[0] <= room.fence.x_m[1]
        world = World(parse_site(drawn.field), drawn.scenario, seed)
        for state in world.states():
            assert abs(state[0]) < half[0] and abs(state[1]) < half[1]
        lengths.append(room.size_m[0])
        shapes.add(drawn.scenario.target.path.shape)
    assert 0.3 < pillars / len(SEEDS) < 0.7
    assert min(lengths) < 7.0 and max(lengths) > 11.0
    assert shapes == {"figure_eight", "random_walk", "sprint", "along_walls", "anywhere", "waypoints"}
