"""Where robots stand and look while they search for a target."""

import math
from collections.abc import Collection, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from groundstation.control.parameters import ControlParameters
from groundstation.estimation.belief import JointBelief
from groundstation.sensing.models import Rectangle, SensorSuite

VIEW_INSET_M = 0.3
FAN_RAD = math.radians(70)
SWEEP_RAD = 0.6
SWEEP_PERIOD_S = 8.0
CIRCUIT_S = 40.0
_SWING_STEPS = 36


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


def search_stands(
    belief: JointBelief,
    robots: Sequence[str],
    parameters: ControlParameters,
    sensors: SensorSuite,
    targets: Collection[str],
) -> dict[str, Stand]:
    """Return where each robot would search for targets: all within the world-fixed view, looking different ways.

    While the prediction of one of them is any good they fan out around it and sweep over it; later they go slowly
    round an ellipse, spread evenly, and turn; where they would come within a column of each other, they only swing to
    and fro about its long axis. In a corner of the view stands may coincide: search_spacing.py moves them apart.
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
            stands[name] = _on_ellipse((x, y), index, len(robots), seconds, view, parameters)
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
    at: tuple[float, float],
    index: int,
    count: int,
    seconds: float,
    view: Rectangle | None,
    parameters: ControlParameters,
) -> Stand:
    rate = 0.8 * parameters.search_yaw_rate_rad_s
    yaw = math.tau * index / count + math.fmod(rate * seconds, math.tau)
    if view is None:
        return Stand(*at, yaw, rate)
    x, y = view.center
    half_x, half_y = view.x_m[1] - x, view.y_m[1] - y
    swing = _swing_rad(max(half_x, half_y), min(half_x, half_y), count, parameters.column_m)
    turned = math.tau * math.fmod(seconds / CIRCUIT_S, 1.0)
    if swing < math.pi / 2:
        turned = swing * math.sin(turned)
    angle = math.tau * (index / count + (0.25 if half_y > half_x else 0.0)) + turned
    return Stand(x + half_x * math.cos(angle), y + half_y * math.sin(angle), yaw, rate)


def _swing_rad(long_m: float, short_m: float, count: int, apart_m: float) -> float:
    """Return how far robots spread evenly over an ellipse may turn to and fro about its long axis and stay apart.

    long_m, short_m: half axes. A quarter turn: they may go all the way round.
    """
    swing = 0.0
    for step in range(1, _SWING_STEPS + 1):
        angle = math.pi / 2 * step / _SWING_STEPS
        turned = [angle + math.tau * index / count for index in range(count)]
        points = [(long_m * math.cos(one), short_m * math.sin(one)) for one in turned]
        if any(math.dist(a, b) < apart_m for a, b in combinations(points, 2)):
            break
        swing = angle
    return swing
