"""The drivers of a campaign get the pads and the fence drawn for a seed."""

import json
import math
from typing import Any

import pytest

from sim_bridge.scenario import Scenario
from sim_bridge.study.faults.draw import draw
from sim_bridge.study.faults.vehicles import placed

FIELD: dict[str, Any] = {
    "room": {"fence": {"x_m": (-3.7, 3.7), "y_m": (-2.7, 2.7), "z_m": (0.0, 2.8)}},
    "cameras": {"ceiling": {}},
    "drones": {"drone_1": {"kind": "ardrone"}, "px4_1": {"kind": "mavlink"}},
}


def test_drivers_know_the_pads_that_were_drawn() -> None:
    """They refuse to start near a flying drone, and send an autopilot its pad until it is observed."""
    field = draw(FIELD, Scenario(), 7, (11.0, 20.0)).field
    drones = field["drones"]
    alone = json.dumps({"name": "drone_1", "pad_m": [9.0, 9.0]})
    fleet = json.dumps({"link": {}, "vehicles": [{"name": "px4_1", "pad_m": [9.0, 9.0], "pad_yaw_rad": 9.0}]})
    others = json.dumps({"name": "mocap"})
    sections = placed([("ardrone", alone), ("mavlink", fleet), ("motion_capture", others)], field)
    first, second, third = (section for _, section in sections)
    assert json.loads(first) == {"name": "drone_1", "pad_m": list(drones["drone_1"]["pad_m"])} and third == others
    (px4,) = json.loads(second)["vehicles"]
    assert px4["pad_m"] == list(drones["px4_1"]["pad_m"])
    assert px4["pad_yaw_rad"] == pytest.approx(math.radians(drones["px4_1"]["pad_yaw_deg"]))


def test_drivers_know_the_fence_that_was_drawn() -> None:
    alone = json.dumps({"name": "drone_1", "safety": {"land_after_s": 2.0}})
    field = draw(FIELD, Scenario(), 7, (11.0, 20.0)).field
    field["room"]["fence"]["x_m"] = (-1.0, 2.0)
    ((_, section),) = placed([("ardrone", alone)], field)
    safety = json.loads(section)["safety"]
    assert safety == {"land_after_s": 2.0, "fence_m": [[-1.0, 2.0], [-2.7, 2.7], [0.0, 2.8]]}
