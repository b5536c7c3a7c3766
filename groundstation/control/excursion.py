"""Limits how far robots may leave the views of world-fixed cameras, so that they are back before they are lost."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from groundstation.arrays import Array
from groundstation.control.crossing import HOLD_GAIN
from groundstation.control.parameters import ControlParameters
from groundstation.control.view import VIEW_INSET_M, spread_m, view_of, way_back_m
from groundstation.estimation.belief import JointBelief
from groundstation.sensing.models import Rectangle, SensorSuite

# Speed per distance [1/s] of a robot that has no time left, on its way back; of all others: HOLD_GAIN.
_BACK_GAIN = 3.0


@dataclass
class Excursions:
    """Limits by uncertainty and time how far robots may go out of sight.

    `unseen_s`: time since a camera last saw each robot; `velocity_errors_m_s`: rms errors of their odometry.
    """

    parameters: ControlParameters
    sensors: SensorSuite

    def __post_init__(self) -> None:
        """Begin with robots that are seen."""
        self.unseen_s: dict[str, float] = {}
        self.velocity_errors_m_s: dict[str, float] = {}

    def left_s(self, name: str, belief: JointBelief) -> float:
        """Return how long a robot may stay out of sight from now on, until its place is too uncertain [s]."""
        p = self.parameters
        unseen_s, error_m_s = self.unseen_s.get(name, 0.0), self.velocity_errors_m_s.get(name, 0.0)
        return time_left_s(spread_m(belief, name), unseen_s, p, error_m_s)

    def allowed_s(self, name: str, belief: JointBelief, places: Array) -> Array:
        """Return the latest time [s] to be at each place (n, 2) and be back in time; inf inside or without views."""
        p = self.parameters
        mean = belief.mean_of(name)
        view = view_of(float(mean[0]), float(mean[1]), name, p.return_height_m, self.sensors)
        if view is None:
            return np.full(len(places), math.inf)
        left_s = self.left_s(name, belief)
        way_m = way_back_m(places, view)
        back_s = left_s - way_m / p.return_speed_m_s - p.return_margin_s
        return np.where(way_m > 0.0, back_s, math.inf)


def within_reach(
    velocity: Array, name: str, belief: JointBelief, parameters: ControlParameters, sensors: SensorSuite,
    error_m_s: float, drift_m_s: Array, near_m: tuple[float, float] | None = None,
) -> Array:  # fmt: skip
    """Return the part of a velocity (2) [m/s; world] with which a robot can still fly back into view.

    It is assumed to be unseen from now on. The view is the world-fixed one at its height nearest to near_m [x, y], or
    to the robot itself; views that it reaches from there in time count as one with it. error_m_s: expected rms error of
    its odometry, above 0 (infinite: it has no time left, and goes to the middle of the view); drift_m_s: motion beyond
    its commands (2) [m/s; world], allowed for at the borders.
    """
    mean, p = belief.mean_of(name), parameters
    left_s = time_left_s(spread_m(belief, name), 0.0, p, error_m_s)
    views = sensors.root_views(float(mean[2]) + sensors.marker_height_m[name])
    view = _connected(mean[:2] if near_m is None else np.array(near_m), views, p.return_speed_m_s * max(0.0, left_s))
    if view is None:
        return velocity
    if not math.isfinite(error_m_s):
        # A robot estimated in view but unseen is elsewhere: towards the middle it is seen sooner.
        view = view.shrunk(math.inf)
    reach_m = p.return_speed_m_s * max(0.0, left_s - p.return_margin_s)
    low, high = np.transpose((view.x_m, view.y_m))
    most, drift = p.return_speed_m_s, np.clip(drift_m_s, -p.return_drift_m_s, p.return_drift_m_s)
    gain = HOLD_GAIN if math.isfinite(error_m_s) else _BACK_GAIN
    slowest = np.clip(gain * (low - reach_m - mean[:2]), -most, most) - drift
    fastest = np.clip(gain * (high + reach_m - mean[:2]), -most, most) - drift
    return np.asarray(np.clip(velocity, slowest, fastest))


def box_about_views(name: str, belief: JointBelief, sensors: SensorSuite, height_m: float) -> Rectangle | None:
    """Return the box about all world-fixed views of a robot at a height, None without one.

    Gaps between views count as inside, else a team could not follow its target from one into the other.
    """
    views = sensors.root_views(height_m + sensors.marker_height_m[name])
    return _connected(belief.mean_of(name)[:2], views, math.inf, inset_m=0.0)


def _connected(
    place: Array, views: Sequence[Rectangle], way_m: float, inset_m: float = VIEW_INSET_M
) -> Rectangle | None:
    """Return the box about the view nearest to a place (2) and all views within `way_m` of that view, less an inset."""
    nearest = min(views, key=lambda view: math.dist(place, view.nearest(*place.tolist())), default=None)
    if nearest is None:
        return None
    near = [view for view in views if _apart_m(nearest, view) <= way_m]
    xs, ys = [x for view in near for x in view.x_m], [y for view in near for y in view.y_m]
    return Rectangle((min(xs), max(xs)), (min(ys), max(ys))).shrunk(inset_m)


def _apart_m(one: Rectangle, other: Rectangle) -> float:
    gaps = ((max(a[0], b[0]) - min(a[1], b[1])) for a, b in ((one.x_m, other.x_m), (one.y_m, other.y_m)))
    return math.hypot(*(max(0.0, gap) for gap in gaps))


def time_left_s(
    spread: float, unseen_s: float, parameters: ControlParameters, velocity_error_m_s: float = 0.0
) -> float:
    """Return how long a robot may go on unseen [s]: until its deviation reaches the limit or its odometry is too old.

    The deviation is assumed to go on growing at its mean rate so far: a wrong velocity adds up evenly.
    velocity_error_m_s: rms error of the odometry; if larger than that of sound odometry, it counts from now on, even if
    the deviation does not show it yet.
    """
    p = parameters
    wrong = velocity_error_m_s if velocity_error_m_s > p.sound_error_m_s else 0.0
    drift = max(p.drift_m_s, wrong, (spread - p.seen_std_m) / unseen_s if unseen_s > 1.0 else 0.0)
    return min((p.return_limit_m - spread) / drift, p.return_within_s - unseen_s)
