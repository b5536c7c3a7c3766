"""Where world-fixed cameras see robots, and how well a place is known."""

import math

from groundstation.control.parameters import ControlParameters
from groundstation.estimation.belief import JointBelief
from groundstation.sensing.models import Rectangle, SensorSuite

VIEW_INSET_M = 0.3
_VELOCITY_ERRORS = ("velocity_bias_x", "velocity_bias_y")
_POINT_M = 1e-6  # a view that is narrower is a line


def view_of(x: float, y: float, name: str, parameters: ControlParameters, sensors: SensorSuite) -> Rectangle | None:
    """Return the world-fixed view at search height that is nearest to a point, a little inside; None without one."""
    views = sensors.root_views(parameters.search_height_m + sensors.marker_height_m[name])
    inside = [view.shrunk(VIEW_INSET_M) for view in views]
    return min(inside, key=lambda view: math.dist((x, y), view.nearest(x, y)), default=None)


def spread_m(belief: JointBelief, name: str) -> float:
    """Return the standard deviation of a position along the axis on which it is known worst [m]."""
    P = belief.covariance_of(name)
    xx, xy, yy = float(P[0, 0]), float(P[0, 1]), float(P[1, 1])
    return math.sqrt(0.5 * (xx + yy + math.hypot(xx - yy, 2.0 * xy)))


def velocity_error_m_s(belief: JointBelief, name: str) -> float:
    """Return the rms error of a robot's reported velocity, as the belief has it: its mean and its deviation [m/s].

    0 where the belief has no such states: in its core, and for vehicles without them.
    """
    block, variances = belief.layout.block(name), belief.covariance_of(name).diagonal()
    entries = [block.labels.index(label) for label in _VELOCITY_ERRORS if label in block.labels]
    return math.sqrt(max((float(belief.mean_of(name)[i] ** 2 + variances[i]) for i in entries), default=0.0))


def way_back_m(x: float, y: float, view: Rectangle) -> float:
    """Return how far it is from a point towards the middle of a view until the point is inside; 0 inside."""
    (x0, x1), (y0, y1), (cx, cy) = view.x_m, view.y_m, view.center
    outside = max(2.0 * abs(x - cx) / max(x1 - x0, _POINT_M), 2.0 * abs(y - cy) / max(y1 - y0, _POINT_M))
    return math.dist((x, y), view.center) * (1.0 - 1.0 / max(outside, 1.0))
