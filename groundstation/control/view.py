"""Views of world-fixed cameras, and the uncertainty of a robot's place."""

import math
from functools import cache

import numpy as np

from groundstation.arrays import Array
from groundstation.control.parameters import SafetyParameters
from groundstation.estimation.belief import JointBelief
from groundstation.estimation.layout import EntityKind
from groundstation.sensing.models import Rectangle, SensorSuite

VIEW_INSET_M = 0.3
_VELOCITY_ERRORS = ("velocity_bias_x", "velocity_bias_y")
_POINT_M = 1e-6  # a narrower view counts as a line
_SEEN_S = 0.5  # longest time between two sightings of a robot in view


def view_of(x: float, y: float, name: str, height_m: float, sensors: SensorSuite) -> Rectangle | None:
    """Return a robot's world-fixed view at a height that is nearest to a point, a little inside; None without one."""
    views = sensors.root_views(height_m + sensors.marker_height_m[name])
    inside = [view.shrunk(VIEW_INSET_M) for view in views]
    return min(inside, key=lambda view: math.dist((x, y), view.nearest(x, y)), default=None)


def spread_m(belief: JointBelief, name: str) -> float:
    """Return the standard deviation of a position along its most uncertain axis [m]."""
    P = belief.covariance_of(name)
    xx, xy, yy = float(P[0, 0]), float(P[0, 1]), float(P[1, 1])
    return math.sqrt(0.5 * (xx + yy + math.hypot(xx - yy, 2.0 * xy)))


def velocity_error_m_s(belief: JointBelief, name: str) -> float:
    """Return the rms error of a robot's reported velocity by the belief, from its mean and deviation [m/s].

    0 where the belief has no such states: in its core, and for vehicles without them.
    """
    entries, mean, covariance = _velocity_errors(belief, name), belief.mean_of(name), belief.covariance_of(name)
    return math.sqrt(max((float(mean[i] ** 2 + covariance[i, i]) for i in entries), default=0.0))


def known_velocity_error_m_s(belief: JointBelief, name: str) -> float:
    """Return the mean alone of a reported velocity's error, as learnt by the filter: the larger of both axes [m/s]."""
    mean = belief.mean_of(name)
    return max((abs(float(mean[i])) for i in _velocity_errors(belief, name)), default=0.0)


def _velocity_errors(belief: JointBelief, name: str) -> tuple[int, ...]:
    return _places_of_errors(belief.layout.block(name).labels)


@cache
def _places_of_errors(labels: tuple[str, ...]) -> tuple[int, ...]:
    return tuple(labels.index(label) for label in _VELOCITY_ERRORS if label in labels)


def doubt_m(belief: JointBelief, name: str) -> float:
    """Return the standard deviation of a robot's position along its most uncertain axis, up and down included [m]."""
    return max(spread_m(belief, name), math.sqrt(max(0.0, float(belief.covariance_of(name)[2, 2]))))


def is_placed(belief: JointBelief, name: str, parameters: SafetyParameters) -> bool:
    """Return whether a position is known well enough to fly on, that of a robot in height, too."""
    axes = 3 if belief.layout.block(name).kind is EntityKind.ROBOT else 2
    variances = belief.covariance_of(name).diagonal()[:axes].tolist()
    return all(0.0 <= variance <= parameters.max_position_std_m**2 for variance in variances)


def is_localised(belief: JointBelief, name: str, unseen_s: float, parameters: SafetyParameters) -> bool:
    """Return whether a robot is known well enough to fly on.

    The velocity of an unseen robot must be known as well: else its position is wrong sooner than its deviation shows.
    """
    lies = (
        known_velocity_error_m_s(belief, name) > parameters.max_known_velocity_error_m_s
        or velocity_error_m_s(belief, name) > parameters.max_velocity_error_m_s
    )
    if unseen_s > _SEEN_S and lies:
        return False
    return is_placed(belief, name, parameters)


class Localisation:
    """Results of `is_localised`, computed once for each belief and name: they are needed many times a tick."""

    def __init__(self, parameters: SafetyParameters) -> None:
        self._parameters = parameters
        self._belief: JointBelief | None = None
        self._judged: dict[tuple[str, float], bool] = {}

    def holds(self, belief: JointBelief, name: str, unseen_s: float) -> bool:
        """Return whether an entity is known well enough to fly on."""
        if belief is not self._belief:
            self._belief, self._judged = belief, {}
        asked = name, unseen_s
        if asked not in self._judged:
            self._judged[asked] = is_localised(belief, name, unseen_s, self._parameters)
        return self._judged[asked]


def way_back_m(places: Array, view: Rectangle) -> Array:
    """Return the distance [m] from places (..., 2), on the way to the middle of a view, until inside it; 0 inside."""
    apart = np.asarray(places) - view.center
    half_sides = np.maximum(np.ptp((view.x_m, view.y_m), axis=1), _POINT_M) / 2.0
    outside = np.maximum((np.abs(apart) / half_sides).max(axis=-1), 1.0)
    return np.asarray(np.hypot(apart[..., 0], apart[..., 1]) * (1.0 - 1.0 / outside))
