"""A robot's return into view of a world-fixed camera: its condition, its goal, and the search for the view there."""

import math

from groundstation.arrays import Array
from groundstation.control.excursion import time_left_s
from groundstation.control.parameters import ControlParameters
from groundstation.control.stand import Stand
from groundstation.control.view import doubt_m, view_of, way_back_m
from groundstation.estimation.belief import JointBelief
from groundstation.sensing.models import Rectangle, SensorSuite

# A robot on its way back goes on until it has this much more time: the way and the time left shrink alike.
_GOES_ON_S = 1.0
_LOOK_M_S = 0.2  # speed along the spiral on which a robot looks for the view
_LOOK_RAD_S = 0.7
_FARTHEST_LOOK_M = 1.2
_LEAST_LOOK_M, _WIDENS_M = 0.3, 0.3  # its least radius; the square of its radius grows by this times the way flown


def is_lost(
    name: str,
    belief: JointBelief,
    parameters: ControlParameters,
    sensors: SensorSuite,
    unseen_s: float = 0.0,
    velocity_error_m_s: float = 0.0,
    returns: bool = False,
) -> bool:
    """Return whether a robot must fly back now, else its place would soon be too uncertain for it to be found again.

    It depends on its uncertainty, the error of its odometry, and the length and time of the way back; without any
    world-fixed view, on the uncertainty alone. returns: whether it was flying back already.
    """
    if unseen_s > max(parameters.return_soonest_s, parameters.return_within_s):
        return True
    mean, spread = belief.mean_of(name), doubt_m(belief, name)
    if spread <= parameters.return_std_m and unseen_s <= parameters.return_soonest_s:
        return False
    left_s = time_left_s(spread, unseen_s, parameters, velocity_error_m_s) - (_GOES_ON_S if returns else 0.0)
    marker = sensors.marker(name, mean, is_robot=True)
    if any(sensors.world_in_view(camera, marker) for camera in sensors.world):
        # A robot estimated in view but unseen may be beside the view: towards the middle it is seen sooner.
        return unseen_s > parameters.return_soonest_s and left_s < parameters.return_margin_s
    view = view_of(float(mean[0]), float(mean[1]), name, parameters.return_height_m, sensors)
    if view is None or unseen_s <= parameters.return_soonest_s:
        return spread > parameters.return_std_m
    x, y, z = (float(value) for value in mean[:3])
    way_m = float(way_back_m(mean[:2], view)) + parameters.detours.extra_m((x, y), view.center, z, spread)
    return left_s < way_m / parameters.return_speed_m_s + parameters.return_margin_s


def return_stand(mean: Array, view: Rectangle | None, looks_s: float = 0.0) -> Stand:
    """Return the middle of a world-fixed view, with the present heading; without a view, the robot's place.

    looks_s: time for which the robot should have been in view and was not: it turns, and circles the middle ever wider,
    until a camera sees it or it sees a known entity. Without a view it turns only: its place moves with it.
    """
    x, y, yaw = float(mean[0]), float(mean[1]), float(mean[3])
    if view is None:
        return Stand(x, y, yaw, _LOOK_RAD_S if looks_s > 0.0 else 0.0)
    x, y = view.center
    if looks_s <= 0.0:
        return Stand(x, y, yaw)
    radius = min(_FARTHEST_LOOK_M, math.sqrt(_WIDENS_M * _LOOK_M_S * looks_s))
    angle = _LOOK_M_S * looks_s / max(radius, _LEAST_LOOK_M)
    return Stand(x + radius * math.cos(angle), y + radius * math.sin(angle), yaw, _LOOK_RAD_S)
