"""What the setpoints of a step depend on: the belief, and who is not seen."""

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from groundstation.arrays import Array
from groundstation.control.parameters import ControlParameters
from groundstation.control.stand import Stand
from groundstation.estimation.belief import JointBelief
from groundstation.sensing.models import SensorSuite

STILL = np.zeros(3)
# Between two views a robot goes on to the one that it flies to: the nearest one changes with each estimate.
_AHEAD_S = 1.0
# After a step of its setpoint a real autopilot has come to 63 % of the velocity within 0.5 to 0.9 s.
FOLLOWS_S = 0.7

Stands = Callable[[Sequence[str], Collection[str]], Mapping[str, Stand]]
"""Where robots search for targets; who has nowhere to search is left out."""


@dataclass(frozen=True, slots=True)
class Sight:
    """Who is not seen, and where those look that search.

    target_age_s: since any target was last observed where it is believed, None if never; unseen_s: since a camera last
    saw each robot; missed_s: since when a camera should see a robot and does not; missing: targets that are to be
    searched for: while others are tracked, one robot does; velocity_errors_m_s: of each robot's odometry, rms;
    drifts_m_s: motion of each robot besides what it is told (3) [m/s; world]; unsteered: robots that follow no
    setpoints: they wait or land; untied_s: since something fixed in the room last told where each robot is, or somebody
    saw it; velocities_m_s: of each robot (3) [m/s; world]; helped_s: since others than the sensors fixed in the room
    last told where each robot is.
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


@dataclass(frozen=True, slots=True)
class Moment:
    """What all setpoints of a step depend on; robots: those in the air whose place is believed."""

    belief: JointBelief
    robots: Sequence[str]
    parameters: ControlParameters
    sensors: SensorSuite
    sight: Sight


def steered(names: Sequence[str], now: Moment) -> list[str]:
    """Return the robots among some that follow setpoints; all of them where none does, for they may soon."""
    return [name for name in names if name not in now.sight.unsteered] or list(names)


def is_untied(name: str, now: Moment) -> bool:
    """Return whether nothing tells where a robot is that flies on our estimate."""
    return name in now.parameters.fed and now.sight.untied_s.get(name, 0.0) > now.parameters.untied_after_s


def soon(name: str, now: Moment) -> tuple[float, float]:
    """Return where a robot will be in a second [x, y; world]."""
    x, y = now.belief.mean_of(name)[:2] + _AHEAD_S * now.sight.velocities_m_s.get(name, STILL)[:2]
    return float(x), float(y)


def at_rest(name: str, now: Moment) -> Array:
    """Return where a robot would come to rest if it were told to stand (2) [m; world]."""
    return np.asarray(now.belief.mean_of(name)[:2] + FOLLOWS_S * now.sight.velocities_m_s.get(name, STILL)[:2])
