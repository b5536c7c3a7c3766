"""Start values of the local search: motion and view directions under one of several world-fixed cameras."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from groundstation.planning.parameters import parameters_from_field
from groundstation.planning.problem import PlanningScene, ProblemBuilder
from groundstation.planning.records import ROBOT_CONTROLS
from groundstation.planning.starts import Starts
from groundstation.sensing.from_field import sensors_from_field
from groundstation.sensing.topology import Topology
from groundstation.settings.load import load_field
from groundstation.settings.resolved import resolved_field

LAB = resolved_field(load_field(Path(__file__).parents[3] / "config/lab.yaml"))
PARAMETERS, SENSORS = parameters_from_field(LAB), sensors_from_field(LAB)
CEILING = SENSORS.world["ceiling"]
HALL = replace(
    SENSORS, world={name: replace(CEILING, position_m=(x, 0.0, 4.2)) for name, x in (("west", -4.0), ("east", 4.0))}
)


def end_of_start_in_view(robot_x_m: float, target_x_m: float) -> float:
    """Return the final x of a robot that faces a target at rest and starts to look at it, in a world-fixed view."""
    ahead = math.copysign(1.0, target_x_m - robot_x_m)
    scene = PlanningScene(
        robots=("drone_1",),
        targets=("turtlebot",),
        poses=np.array([[robot_x_m, 0.0, 1.6, math.acos(ahead)]]),
        moving=np.array([[target_x_m, 0.0, 0.0, 0.0]]),
        prior=0.01 * np.eye(3),
        yaw_variances=np.array([0.01]),
    )
    builder, topology = ProblemBuilder(PARAMETERS, HALL), Topology.flat(("drone_1",))
    starts = Starts(scene, PARAMETERS, HALL, builder.scale(scene), builder.height_m)
    _, in_view, _, _ = starts.of(topology, None, ())
    velocity = in_view.reshape(-1, ROBOT_CONTROLS)[0, 0] * builder.scale(scene)[0]
    return robot_x_m + ahead * float(velocity) * PARAMETERS.horizon_s


@pytest.mark.parametrize("side", [-1, 1])
def test_a_robot_goes_and_looks_from_the_view_on_its_own_side(side: int) -> None:
    view = HALL.root_views(PARAMETERS.heights_m[0])[(side + 1) // 2]
    end = end_of_start_in_view(side * 4.0, side * 6.5)
    assert view.x_m[0] < end < view.x_m[1]
    assert side * (end - side * 4.0) > 0.3


def test_between_two_views_a_robot_goes_to_the_nearer_one() -> None:
    assert end_of_start_in_view(-0.5, 0.6) < -0.6
    assert end_of_start_in_view(0.5, -0.6) > 0.6
