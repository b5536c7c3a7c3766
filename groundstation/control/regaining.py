"""Regains a target that left a tracking robot's picture: before any search the robot turns to it and backs off."""

import math
from collections.abc import Collection

import numpy as np

from groundstation.arrays import Array
from groundstation.control.view import spread_m
from groundstation.estimation.belief import JointBelief
from groundstation.geometry.angles import difference
from groundstation.geometry.stabilized_frame import stabilized_from_world
from groundstation.sensing.models import SensorSuite
from groundstation.sensing.topology import Topology

_WAY_GAIN, _TURN_GAIN = 1.5, 2.0  # of its error in distance and heading [1/s]
_FASTEST_M_S = 0.5
_ABOVE_RAD = 0.12  # a target is kept this much above the middle of the picture: a robot that backs off tips it up
_MOST_SPREAD_M = 0.6  # with a wider belief the distance to back off is unknown
_NEAREST_M = 0.3


def who_regains(
    target: str, topology: Topology, belief: JointBelief, sensors: SensorSuite, able: Collection[str]
) -> Collection[str]:
    """Return the robots that regain a target: the lowest level, or the nearest robot if only others have it in reach.

    able: those that follow setpoints.
    """
    at, lowest = belief.mean_of(target)[:2], topology.levels[-1].intersection(able)
    eyes = [name for name in able if name in topology.robots and name in sensors.onboard]
    ways_m = {name: math.dist(belief.mean_of(name)[:2], at) for name in eyes}
    near = [name for name in eyes if ways_m[name] <= sensors.onboard[name].view.range_m]
    return lowest if not near or lowest.intersection(near) else (min(near, key=ways_m.__getitem__),)


def regaining(robot: str, target: str, belief: JointBelief, sensors: SensorSuite) -> tuple[Array, float] | None:
    """Return velocity (2) [m/s; base_stabilized] and yaw rate [rad/s] that bring a target into the picture.

    The robot faces the target, at the distance from which its camera has it above the middle of the picture, farther by
    one standard deviation of its place, and moves along with it. Returns None for a robot whose camera does not look
    down.
    """
    eye = sensors.onboard.get(robot)
    if eye is None:
        return None
    mean, at = belief.mean_of(robot), belief.mean_of(target)
    down_rad = eye.tilt_down_rad - _ABOVE_RAD
    height = float(mean[2]) + eye.position_m[2] - sensors.marker_height_m[target]
    if down_rad <= 0.0 or height <= 0.0:
        return None
    way = at[:2] - mean[:2]
    distance = max(float(np.hypot(*way)), 1e-6)
    reach = min(height / math.tan(down_rad), 0.8 * math.sqrt(max(eye.view.range_m**2 - height**2, _NEAREST_M**2)))
    wanted = reach + min(spread_m(belief, target), _MOST_SPREAD_M)
    velocity = at[2:4] + _WAY_GAIN * (distance - wanted) * way / distance
    velocity = velocity * min(1.0, _FASTEST_M_S / max(float(np.hypot(*velocity)), 1e-9))
    yaw = float(mean[3])
    bearing = math.atan2(float(way[1]), float(way[0]))
    body = stabilized_from_world(np.append(velocity, 0.0), yaw)
    return np.asarray(body[:2]), _TURN_GAIN * difference(bearing, yaw)
