"""Scores of a flight at message level: mean and greatest position error of a robot."""

import json
import math

import numpy as np
import pytest

from groundstation.estimation.belief import JointBelief
from groundstation.estimation.layout import EntityKind, StateLayout
from sim_bridge.study.score import FlightScore

_ROBOT, _TARGET = ("x", "y", "z", "yaw"), ("x", "y", "vx", "vy")


def test_the_greatest_error_is_that_of_each_robots_horizontal_position() -> None:
    layout = StateLayout().with_entity("a", EntityKind.ROBOT, _ROBOT).with_entity("t", EntityKind.TARGET, _TARGET)
    belief = JointBelief(np.zeros(8), 0.01 * np.eye(8), layout, 0)
    score = FlightScore(period_s=0.1)
    for off in (0.0, 0.6, -0.1):
        robot, target = np.zeros(13), np.zeros(13)
        robot[:3], target[0] = (off, 0.75 * off, 2.0), 3.0
        score.take(belief, {"a": robot, "t": target}, ("t",), "a", {"a": 0.0})
    report = score.report()
    assert report["robot_max_m"] == {"a": pytest.approx(0.75)}
    assert report["target_max_m"] == pytest.approx(3.0)
    assert report["min_separation_m"] is None, "one drone is apart from nobody"
    score.take(belief, {"a": robot, "t": target}, ("t",), "a", {"a": math.inf})
    assert '"longest_unseen_s": null' in json.dumps(score.report(), allow_nan=False)
