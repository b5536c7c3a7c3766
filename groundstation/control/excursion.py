"""How far robots may leave the sight of the world-fixed cameras, so that they come back before they are lost."""

import math
from dataclasses import dataclass

import numpy as np

from groundstation.arrays import Array
from groundstation.control.parameters import ControlParameters
from groundstation.control.view import spread_m, view_of, way_back_m
from groundstation.estimation.belief import JointBelief
from groundstation.sensing.models import SensorSuite


@dataclass
class Excursions:
    """Judges ways out of sight by uncertainty and time.

    `unseen_s`: since a camera last saw each robot; `velocity_errors_m_s`: rms errors of their odometry.
    """

    parameters: ControlParameters
    sensors: SensorSuite

    def __post_init__(self) -> None:
        """Begin with robots that are seen."""
        self.unseen_s: dict[str, float] = {}
        self.velocity_errors_m_s: dict[str, float] = {}

    def left_s(self, name: str, belief: JointBelief) -> float:
        """Return for how long a robot may stay out of sight from now on, until its place is known too badly [s]."""
        p = self.parameters
        unseen_s, error_m_s = self.unseen_s.get(name, 0.0), self.velocity_errors_m_s.get(name, 0.0)
        return time_left_s(spread_m(belief, name), unseen_s, p, error_m_s)

    def allowed_s(self, name: str, belief: JointBelief, places: Array) -> Array:
        """Return within how long a robot has to be at each place (n, 2), to be back in time; where it is seen: inf."""
        p = self.parameters
        mean = belief.mean_of(name)
        view = view_of(float(mean[0]), float(mean[1]), name, p, self.sensors)
        if view is None:
            return np.full(len(places), math.inf)
        left_s = self.left_s(name, belief)
        way_m = way_back_m(places, view)
        back_s = left_s - way_m / p.return_speed_m_s - p.return_margin_s
        return np.where(way_m > 0.0, back_s, math.inf)


def time_left_s(
    spread: float, unseen_s: float, parameters: ControlParameters, velocity_error_m_s: float = 0.0
) -> float:
    """Return how long a robot may go on unseen: until its deviation reaches the limit, or odometry is trusted no more.

    Its deviation has grown with the time, and goes on so: a wrong velocity adds up evenly. velocity_error_m_s: rms
    error of the odometry; one that no sound odometry has adds up from now on, though it has not yet.
    """
    p = parameters
    wrong = velocity_error_m_s if velocity_error_m_s > p.sound_error_m_s else 0.0
    drift = max(p.drift_m_s, wrong, (spread - p.seen_std_m) / unseen_s if unseen_s > 1.0 else 0.0)
    return min((p.return_limit_m - spread) / drift, p.return_within_s - unseen_s)
