"""The inputs of a step's setpoints: the belief, and the times since robots and targets were seen."""

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from groundstation.arrays import Array
from groundstation.control.flight_mode import FlightMode
from groundstation.control.parameters import ControlParameters
from groundstation.control.stand import Stand
from groundstation.estimation.belief import JointBelief
from groundstation.sensing.models import SensorSuite

STILL = np.zeros(3)
# A robot between two views goes on to the one ahead: the nearest one may change with each estimate.
_AHEAD_S = 1.0
# A real autopilot reaches 63 % of a step of its velocity setpoint within 0.5 to 0.9 s.
FOLLOWS_S = 0.7

Stands = Callable[[Sequence[str], Collection[str]], Mapping[str, Stand]]
"""Returns where robots search for targets; robots without a place to search are left out."""


@dataclass(frozen=True, slots=True)
class Sight:
    """Times since robots and targets were seen, and the places where robots search.

    target_age_s: time since a target was last observed at its estimated place, None if never; unseen_s: time since a
    camera last saw each robot; missed_s: time for which a camera has missed a robot that it should see; missing:
    targets to be searched for, by one robot while others are tracked; velocity_errors_m_s: rms error of each robot's
    odometry; drifts_m_s: motion of each robot beyond its commands (3) [m/s; world]; unsteered: robots that follow no
    setpoints: they wait or land; untied_s: time since a sensor fixed in the room last located each robot, or another
    one saw it; velocities_m_s: of each robot (3) [m/s; world]; helped_s: time since others than the sensors fixed in
    the room last located each robot; before: modes of the robots in the last step; blind: robots that cannot search.
    """

    target_age_s: float | None = None
    unseen_s: Mapping[str, float] = field(default_factory=dict)
    missed_s: Mapping[str, float] = field(default_factory=dict)
    missing: Collection[str] = ()
    search: Stands = lambda _robots, _targets: {}
    velocity_errors_m_s: Mapping[str, float] = field(default_factory=dict)
    drifts_m_s: Mapping[str, Array] = field(default_factory=dict)
    unsteered: Collection[str] = ()
    untied_s: Mapping[str, float] = field(default_factory=dict)
    velocities_m_s: Mapping[str, Array] = field(default_factory=dict)
    helped_s: Mapping[str, float] = field(default_factory=dict)
    before: Mapping[str, FlightMode] = field(default_factory=dict)
    blind: Collection[str] = ()


@dataclass(frozen=True, slots=True)
class Moment:
    """The inputs of all setpoints of a step; robots: those in the air with a trusted estimate."""

    belief: JointBelief
    robots: Sequence[str]
    parameters: ControlParameters
    sensors: SensorSuite
    sight: Sight


def steered(names: Sequence[str], now: Moment) -> list[str]:
    """Return the robots that follow setpoints; all of them if none does, because they may soon."""
    return [name for name in names if name not in now.sight.unsteered] or list(names)


def is_untied(name: str, now: Moment) -> bool:
    """Return whether a robot flies on our estimate and no sensor locates it any more."""
    return name in now.parameters.fed and now.sight.untied_s.get(name, 0.0) > now.parameters.untied_after_s


def soon(name: str, now: Moment) -> tuple[float, float]:
    """Return a robot's predicted place in one second (x, y) [m; world]."""
    x, y = now.belief.mean_of(name)[:2] + _AHEAD_S * now.sight.velocities_m_s.get(name, STILL)[:2]
    return float(x), float(y)


def at_rest(name: str, now: Moment) -> Array:
    """Return the place where a robot would come to rest if it were stopped now (2) [m; world]."""
    return np.asarray(now.belief.mean_of(name)[:2] + FOLLOWS_S * now.sight.velocities_m_s.get(name, STILL)[:2])
