"""When a robot flies back to where a world-fixed camera sees it, and to which place."""

import math

from groundstation.arrays import Array
from groundstation.control.parameters import ControlParameters
from groundstation.control.search import Stand, spread_m, view_of
from groundstation.estimation.belief import JointBelief
from groundstation.sensing.models import Rectangle, SensorSuite

_POINT_M = 1e-6  # a view that is narrower is a line


def is_lost(
    name: str, belief: JointBelief, parameters: ControlParameters, sensors: SensorSuite, unseen_s: float = 0.0
) -> bool:
    """Return whether a robot must fly back: badly localised outside every fixed view, or unseen for too long."""
    mean, spread = belief.mean_of(name), spread_m(belief, name)
    view = view_of(float(mean[0]), float(mean[1]), name, parameters, sensors)
    way = spread + way_back_m(float(mean[0]), float(mean[1]), view) if view else 0.0
    if unseen_s > return_after_s(way, parameters):
        return True
    if spread <= parameters.return_std_m:
        return False
    marker = sensors.marker(name, mean, is_robot=True)
    return not any(sensors.world_in_view(camera, marker) for camera in sensors.world)


def return_after_s(way_m: float, parameters: ControlParameters) -> float:
    """Return after how long unseen a robot flies back, so that it is seen again before it would have to land."""
    needed_s = way_m / parameters.return_speed_m_s + parameters.return_margin_s
    latest_s = parameters.unseen_land_after_s - needed_s
    return min(parameters.return_unseen_s, max(latest_s, parameters.return_soonest_s))


def way_back_m(x: float, y: float, view: Rectangle) -> float:
    """Return how far it is from a point towards the middle of a view until the point is inside; 0 inside."""
    (x0, x1), (y0, y1), (cx, cy) = view.x_m, view.y_m, view.center
    outside = max(2.0 * abs(x - cx) / max(x1 - x0, _POINT_M), 2.0 * abs(y - cy) / max(y1 - y0, _POINT_M))
    return math.dist((x, y), view.center) * (1.0 - 1.0 / max(outside, 1.0))


def return_stand(mean: Array, view: Rectangle | None) -> Stand:
    """Return the middle of a world-fixed view, with the heading as it is; without a view, where the robot is."""
    x, y, yaw = float(mean[0]), float(mean[1]), float(mean[3])
    return Stand(*(view.center if view else (x, y)), yaw)
