"""Where robots stand and look while they search for a target, or fly back to where they are seen."""

import math
from collections.abc import Collection, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from groundstation.control.parameters import ControlParameters
from groundstation.estimation.belief import JointBelief
from groundstation.sensing.models import Rectangle, SensorSuite

Array = NDArray[np.float64]

VIEW_INSET_M = 0.3
FAN_RAD = math.radians(70)
SWEEP_RAD = 0.6
SWEEP_PERIOD_S = 8.0
CIRCUIT_S = 40.0


@dataclass(frozen=True, slots=True)
class Stand:
    """A place [m; world], a heading [rad; world] and how fast the heading itself turns [rad/s]."""

    x: float
    y: float
    yaw: float
    yaw_rate: float = 0.0


def view_of(x: float, y: float, name: str, parameters: ControlParameters, sensors: SensorSuite) -> Rectangle | None:
    """Return the world-fixed view at search height that is nearest to a point, a little inside; None without one."""
    views = sensors.root_views(parameters.search_height_m + sensors.marker_height_m[name])
    inside = [view.shrunk(VIEW_INSET_M) for view in views]
    return min(inside, key=lambda view: math.dist((x, y), view.nearest(x, y)), default=None)


def return_stand(mean: Array, parameters: ControlParameters, sensors: SensorSuite) -> Stand:
    """Return the middle of the nearest world-fixed view, with the heading as it is."""
    x, y, yaw = float(mean[0]), float(mean[1]), float(mean[3])
    views = sensors.root_views(parameters.search_height_m)
    middle = min((view.center for view in views), key=lambda point: math.dist(point, (x, y)), default=(x, y))
    return Stand(*middle, yaw)


def search_stands(
    belief: JointBelief,
    robots: Sequence[str],
    parameters: ControlParameters,
    sensors: SensorSuite,
    targets: Collection[str],
) -> dict[str, Stand]:
    """Return where each robot searches for targets: all within the world-fixed view, looking different ways.

    While the prediction of one of them is any good they fan out around it and sweep over it; later each
    goes slowly round an ellipse, opposite to the others, and turns.
    """
    hint = _hint(belief, parameters, targets)
    seconds = belief.stamp_ns * 1e-9
    stands = {}
    for index, name in enumerate(robots):
        x, y = (float(value) for value in belief.mean_of(name)[:2])
        view = view_of(x, y, name, parameters, sensors)
        share = index / len(robots)
        if hint is not None:
            part = index - (len(robots) - 1) / 2
            stands[name] = _around(hint, (x, y), part, share, seconds, view, parameters)
        else:
            stands[name] = _on_ellipse((x, y), share, seconds, view, parameters)
    return stands


def _hint(belief: JointBelief, parameters: ControlParameters, targets: Collection[str]) -> tuple[float, float] | None:
    """Return where the one of the targets is that is known best, if it is known at all well."""
    spread, name = min(
        ((spread_m(belief, name), name) for name in targets if name in belief.layout), default=(math.inf, "")
    )
    if not spread <= parameters.hint_std_m:
        return None
    mean = belief.mean_of(name)
    return float(mean[0]), float(mean[1])


def spread_m(belief: JointBelief, name: str) -> float:
    """Return the standard deviation of a position along the axis on which it is known worst [m]."""
    return math.sqrt(float(np.linalg.eigvalsh(belief.covariance_of(name)[:2, :2])[-1]))


def _around(
    hint: tuple[float, float],
    at: tuple[float, float],
    part: float,
    share: float,
    seconds: float,
    view: Rectangle | None,
    parameters: ControlParameters,
) -> Stand:
    center = view.center if view else at
    if math.dist(center, hint) < 0.3:
        center = at
    bearing = math.atan2(center[1] - hint[1], center[0] - hint[0]) + part * FAN_RAD
    x = hint[0] + parameters.search_stand_off_m * math.cos(bearing)
    y = hint[1] + parameters.search_stand_off_m * math.sin(bearing)
    if view:
        x, y = view.nearest(x, y)
    phase = math.tau * (seconds / SWEEP_PERIOD_S + share)
    yaw = math.atan2(hint[1] - at[1], hint[0] - at[0]) + SWEEP_RAD * math.sin(phase)
    return Stand(x, y, yaw, SWEEP_RAD * math.tau / SWEEP_PERIOD_S * math.cos(phase))


def _on_ellipse(
    at: tuple[float, float], share: float, seconds: float, view: Rectangle | None, parameters: ControlParameters
) -> Stand:
    rate = 0.8 * parameters.search_yaw_rate_rad_s
    yaw = math.tau * share + math.fmod(rate * seconds, math.tau)
    if view is None:
        return Stand(*at, yaw, rate)
    angle = math.tau * (share + 0.25 + math.fmod(seconds / CIRCUIT_S, 1.0))
    half_x, half_y = (view.x_m[1] - view.x_m[0]) / 2, (view.y_m[1] - view.y_m[0]) / 2
    x, y = view.center
    return Stand(x + half_x * math.cos(angle), y + half_y * math.sin(angle), yaw, rate)
