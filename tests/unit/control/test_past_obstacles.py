"""Stands, and the ways to them, past the obstacles of the field."""

import math
from collections.abc import Collection, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from groundstation.control.flight_mode import FlightMode
from groundstation.control.moment import Sight
from groundstation.control.parameters import ControlParameters, control_from_field, safety_from_field
from groundstation.control.returning import is_lost
from groundstation.control.search_parameters import search_from_field
from groundstation.control.search_reach import extra_ways_m, permitted
from groundstation.control.setpoints import Setpoint, setpoints_from_plan
from groundstation.control.stand import Stand
from groundstation.estimation.belief import JointBelief
from groundstation.estimation.layout import ROBOT_CORE, EntityKind, StateLayout
from groundstation.sensing.from_field import boxes_from_field, sensors_from_field
from groundstation.settings.load import load_field
from groundstation.settings.resolved import resolved_field

_PILLAR = "room.obstacles={pillar: {centre_m: [1.5, 0.0], size_m: [0.4, 0.4, 3.0]}}"
_FILE = Path(__file__).parents[3] / "config/lab.yaml"
LAB, EMPTY = resolved_field(load_field(_FILE, (_PILLAR,))), resolved_field(load_field(_FILE))
SENSORS, CONTROL, FREE = sensors_from_field(LAB), control_from_field(LAB), control_from_field(EMPTY)
LAYOUT = StateLayout().with_entity("drone_1", EntityKind.ROBOT, ROBOT_CORE)
BEFORE = (0.3, 0.1, 1.4, 0.0)


def told(control: ControlParameters, pose: tuple[float, ...], stand: Stand) -> Setpoint:
    def search(robots: Sequence[str], _targets: Collection[str]) -> dict[str, Stand]:
        return dict.fromkeys(robots, stand)

    at = JointBelief(np.array(pose), 0.03**2 * np.eye(4), LAYOUT, 0)
    return setpoints_from_plan(None, at, ("drone_1",), control, SENSORS, Sight(None, search=search))["drone_1"]


def test_the_limiter_knows_the_obstacles_of_the_field() -> None:
    safety = safety_from_field(LAB)
    assert safety.obstacles == boxes_from_field(LAB) and len(safety.obstacles) == 1
    assert safety.obstacle_distance_m == 0.5 * LAB.safety.min_separation_m
    assert safety_from_field(EMPTY).obstacles == ()


def test_a_searching_robot_flies_round_a_pillar_at_full_speed() -> None:
    """The corner is near, the stand is not: it does not slow down at the corner."""
    behind = Stand(2.6, 0.1, 0.0)
    straight, past = told(FREE, BEFORE, behind), told(CONTROL, BEFORE, behind)
    assert straight.phase is past.phase is FlightMode.SEARCH
    assert straight.velocity_m_s[:2] == pytest.approx((CONTROL.search_speed_m_s, 0.0))
    assert math.hypot(*past.velocity_m_s[:2]) == pytest.approx(CONTROL.search_speed_m_s)
    assert past.velocity_m_s[1] > 0.3
    near_a_corner = told(CONTROL, (0.7, 0.85, 1.4, 0.0), behind)
    assert math.hypot(*near_a_corner.velocity_m_s[:2]) == pytest.approx(CONTROL.search_speed_m_s)


def test_no_robot_searches_from_a_place_too_near_to_an_obstacle() -> None:
    places = np.array([[1.5, 0.0], [0.9, 0.0], [0.5, 0.0], [1.5, 0.9]])
    search = search_from_field(LAB)
    past, free = (extra_ways_m("drone_1", places, control, SENSORS) for control in (CONTROL, FREE))
    assert permitted("drone_1", places, past, search, CONTROL, SENSORS).tolist() == [False, False, True, True]
    assert permitted("drone_1", places, free, search, FREE, SENSORS).all()


def test_a_longer_way_back_begins_sooner() -> None:
    """Behind a wide cupboard the view is near, and the way into it is not."""
    wide = resolved_field(load_field(_FILE, ("room.obstacles={cupboard: {centre_m: [0, 1.2], size_m: [3, 0.4, 3]}}",)))
    at = JointBelief(np.array([0.0, 2.2, 1.4, 0.0]), 0.15**2 * np.eye(4), LAYOUT, 0)
    sensors, past = sensors_from_field(wide), control_from_field(wide)
    free, behind = ([is_lost("drone_1", at, control, sensors, s) for s in range(2, 15)] for control in (FREE, past))
    assert sum(behind) > sum(free)


def test_a_stand_in_an_obstacle_is_approached_as_far_as_allowed() -> None:
    near = CONTROL.detours.way(BEFORE[:2], (0.95, 0.0), BEFORE[2], 0.03).next_m
    assert near == pytest.approx((0.65, 0.0))
    assert told(CONTROL, (*near, 1.4, 0.0), Stand(0.95, 0.0, 0.0)).velocity_m_s[:2] == pytest.approx((0.0, 0.0))
    assert replace(CONTROL, detours=FREE.detours) == FREE
