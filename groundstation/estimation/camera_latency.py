"""Error of each camera's calibrated delay, estimated in flight from the headings of the robots that it sees.

Gyroscopes show without delay how far a robot turned within a second; a picture older than its stamp shows it for a
different second. Only headings are used: velocity errors last, and controls react to them. The estimate is independent
of the filter, and does not act on it.
"""

import math
from collections import deque
from dataclasses import dataclass, field

import numpy as np

from groundstation.arrays import Array
from groundstation.geometry.parabola import least
from groundstation.time_units import NS_PER_S

# Lateness values that are tried [s], and the approximate distance in time of two compared sightings [s].
_TRIED_S = np.arange(-0.10, 0.2001, 0.02)
_WINDOW_S, _WIDEST_S = 1.0, 1.3
_KEPT_S, _SPACING_S = 3.0, 0.01
_GAP_S = 0.5  # the turn within a longer gap is unknown
_NEAR = 4
_HALF_LIFE_S = 60.0
# Deviation of such a difference, and the squared normalised misfit beyond which outliers count less.
_COARSE_STD_RAD, _WILD = 0.03, 8.0
_LEAST_PAIRS, _UNTOLD_S = 60.0, 0.025
# Number of subjects followed per camera: more are not worth the time. One unseen for this long [s] is dropped.
_FOLLOWED, _GONE_S = 4, 5.0


@dataclass(frozen=True, slots=True)
class Lateness:
    """Excess of a camera's delay over the calibrated one, and its standard deviation [s]."""

    sensor: str
    offset_s: float
    std_s: float


@dataclass(slots=True)
class _Turning:
    """A robot's own headings [rad, unwrapped] and their times [s] since its heading last jumped."""

    reset: int
    times: deque[float] = field(default_factory=deque)
    headings: deque[float] = field(default_factory=deque)

    def take(self, at: float, yaw: float, reset: int) -> None:
        if reset != self.reset or (self.times and at - self.times[-1] > _GAP_S):
            self.times.clear()
            self.headings.clear()
            self.reset = reset
        if self.times and at - self.times[-1] < _SPACING_S:
            return  # recent enough already, or an old sample
        last = self.headings[-1] if self.headings else yaw
        self.times.append(at)
        self.headings.append(last + math.remainder(yaw - last, math.tau))
        while self.times[-1] - self.times[0] > _KEPT_S:
            self.times.popleft()
            self.headings.popleft()

    def between(self, first: float, second: float) -> Array | None:
        """Return how far it turned between two times, with both times earlier by each lateness tried.

        None if unknown.
        """
        if not self.times or self.times[0] > first - _TRIED_S[-1] or self.times[-1] < second - _TRIED_S[0]:
            return None
        times, headings = np.array(self.times), np.array(self.headings)
        at_second, at_first = (np.interp(at - _TRIED_S, times, headings) for at in (second, first))
        return np.asarray(at_second - at_first)


@dataclass(slots=True)
class _Sensor:
    """Forgetting sums over the pairs of one camera: chi-square by lateness, pairs, pictures a second; last pair."""

    chi: Array = field(default_factory=lambda: np.zeros(len(_TRIED_S)))
    pairs: float = 0.0
    overlapping: float = 0.0
    at: float = -math.inf

    def take(self, at: float, misfit: Array, overlapping: int) -> None:
        kept = 0.5 ** (max(0.0, at - self.at) / _HALF_LIFE_S) if self.at > -math.inf else 0.0
        self.at = max(self.at, at)
        squares = (misfit / _COARSE_STD_RAD) ** 2
        self.chi = kept * self.chi + _WILD * np.log1p(squares / _WILD)
        self.pairs = kept * self.pairs + 1.0
        self.overlapping = kept * self.overlapping + overlapping

    def told(self) -> tuple[float, float] | None:
        """Return lateness and one sigma [s]; None where it is unknown."""
        found = least(_TRIED_S, self.chi, _NEAR) if self.pairs >= _LEAST_PAIRS else None
        if found is None or found.curvature <= 0.0:
            return None
        # Pairs overlap: by the scatter over flights, those of half a window count as one. Scaled by the remaining
        # misfit.
        left = float(self.chi[found.nearest]) / self.pairs
        variance = max(1.0, 0.5 * self.overlapping / self.pairs) * left / found.curvature
        return found.place, math.sqrt(variance)


class LatenessWatch:
    """`turned` and `saw` take headings and sightings with their original stamps; `told` returns the result."""

    def __init__(self) -> None:
        self._robots: dict[str, _Turning] = {}
        self._sights: dict[tuple[str, str], deque[tuple[float, float]]] = {}
        self._waiting: dict[tuple[str, str], deque[tuple[float, float]]] = {}
        self._followed: dict[str, dict[str, float]] = {}
        self._sensors: dict[str, _Sensor] = {}

    def turned(self, robot: str, stamp_ns: int, yaw_rad: float, reset: int) -> None:
        """Take a robot's own heading."""
        self._robots.setdefault(robot, _Turning(reset)).take(stamp_ns / NS_PER_S, yaw_rad, reset)

    def saw(self, sensor: str, observer: str, subject: str, stamp_ns: int, yaw_rad: float | None) -> None:
        """Take a sighting with the heading of its subject relative to its observer; others are ignored."""
        if yaw_rad is None or subject not in self._robots or not self._follows(sensor, subject, stamp_ns / NS_PER_S):
            return
        waiting = self._waiting.setdefault((sensor, subject), deque(maxlen=60))
        waiting.append((stamp_ns / NS_PER_S, yaw_rad))
        own = self._robots.get(observer)
        newest = min(robot.times[-1] for robot in (self._robots[subject], own) if robot is not None and robot.times)
        while waiting and waiting[0][0] - _TRIED_S[0] <= newest:
            self._compare(sensor, observer, subject, *waiting.popleft())

    def told(self) -> tuple[Lateness, ...]:
        """Return the lateness of each camera for which it is known to 25 ms or better."""
        found = [(name, sensor.told()) for name, sensor in self._sensors.items()]
        return tuple(Lateness(name, *one) for name, one in found if one is not None and one[1] <= _UNTOLD_S)

    def _follows(self, sensor: str, subject: str, at: float) -> bool:
        followed = self._followed.setdefault(sensor, {})
        for name in [name for name, seen_at in followed.items() if at - seen_at > _GONE_S]:
            del followed[name]
        if subject not in followed and len(followed) >= _FOLLOWED:
            return False
        followed[subject] = at
        return True

    def _compare(self, sensor: str, observer: str, subject: str, at: float, yaw: float) -> None:
        sights = self._sights.setdefault((sensor, subject), deque())
        if sights and at <= sights[-1][0]:
            return
        sights.append((at, yaw))
        while sights[0][0] < at - _WIDEST_S:
            sights.popleft()
        since = [one for one in sights if one[0] <= at - _WINDOW_S]
        turned = self._robots[subject].between(since[-1][0], at) if since else None
        if turned is None:
            return
        if observer in self._robots:
            own = self._robots[observer].between(since[-1][0], at)
            if own is None:
                return
            turned = turned - own
        misfit = np.asarray((yaw - since[-1][1] - turned + math.pi) % math.tau - math.pi)
        self._sensors.setdefault(sensor, _Sensor()).take(at, misfit, len(sights))
