"""Random faults of a campaign: each of a drone or camera that can have it."""

from typing import Any

import pytest

from drivers.watchdog_types import WatchdogLimits
from sim_bridge.fault_kinds import FaultKind
from sim_bridge.scenario import Scenario
from sim_bridge.study.faults.draw import KINDS, draw
from sim_bridge.study.faults.flight_order import WrongOrder

WINDOW_S = (11.0, 20.0)
MAVLINK_ONLY: dict[str, Any] = {
    "room": {"fence": {"x_m": (-3.7, 3.7), "y_m": (-2.7, 2.7), "z_m": (0.0, 2.8)}},
    "cameras": {"ceiling": {}},
    "drones": {"px4_1": {"kind": "mavlink"}, "px4_2": {"kind": "mavlink"}},
}


def test_kinds_that_nothing_in_the_field_can_have_are_not_drawn() -> None:
    flights = [draw(MAVLINK_ONLY, Scenario(), seed, WINDOW_S).scenario.faults for seed in range(200)]
    of_ardrones = {FaultKind.UNIFORM_FLOOR, FaultKind.OBSTACLE_BELOW}
    assert {fault.kind for faults in flights for fault in faults} == set(KINDS) - of_ardrones


def test_a_charge_is_stuck_below_and_above_the_one_that_makes_a_drone_land() -> None:
    kinds = (FaultKind.BATTERY_STUCK,)
    flights = [draw(MAVLINK_ONLY, Scenario(), seed, WINDOW_S, kinds).scenario.faults for seed in range(100)]
    stuck = [fault.amount for faults in flights for fault in faults]
    least = WatchdogLimits().battery_min
    assert 0.3 < sum(charge < least for charge in stuck) / len(stuck) < 0.7


def test_a_campaign_of_such_kinds_alone_is_refused() -> None:
    with pytest.raises(WrongOrder, match="uniform_floor: nothing in this field can have such a fault: name other"):
        draw(MAVLINK_ONLY, Scenario(), 1, WINDOW_S, (FaultKind.UNIFORM_FLOOR,))
