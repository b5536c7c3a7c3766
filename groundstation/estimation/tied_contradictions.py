"""Finds fixed cameras that contradict robots which agree with each other. Pure.

A robot unseen for a while may be lost, and is then placed where the camera sees it. Two robots that see each other, or
one target, in the expected places cannot be lost by the same amount: then the camera has moved. Nor can a robot that
the camera saw in the expected place a moment ago be lost by more than it can fly in that time.
"""

import math
from collections import deque
from collections.abc import Collection, Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from itertools import combinations

import numpy as np

from groundstation.arrays import Vector
from groundstation.bus.messages import Verdict
from groundstation.estimation.event_log import FAR, HASTY, OTHER_POSE
from groundstation.estimation.measurement import Correction
from groundstation.estimation.sight_jumps import ALONE_M_S
from groundstation.geometry.camera_turn import CameraTurn, Displacement, camera_turn

# A contradiction counts for this time; it needs this many sightings over this time, all with the same offset but for a
# share of it.
_COUNTS_S, _LEAST, _LASTS_S, _STEADY = 1.5, 4, 0.3, 0.3
_TIED_S = 1.0
_LEAST_M = 0.15
_MOMENT_S = 0.4
# Taken from whichever of two poses was nearer to the belief: both have the marker in nearly the same place.
_CONTRADICTS = frozenset(f"{why}{also}" for why in (FAR, HASTY) for also in ("", f"; {OTHER_POSE}"))

Pair = tuple[str, str]


@dataclass(frozen=True, slots=True)
class _Contradiction:
    """A camera's contradiction of a robot's place: its begin, time since they last agreed then [s].

    rows: times and residuals.
    """

    since_s: float
    after_s: float
    rows: deque[tuple[float, Vector]] = field(default_factory=lambda: deque(maxlen=15))

    def is_over(self, now_s: float) -> bool:
        """Return whether none of its sightings counts any more."""
        return now_s - self.rows[-1][0] > _COUNTS_S

    def lasting(self, now_s: float) -> Vector | None:
        """Return its offset [m; camera_optical], if it is lasting and constant."""
        kept = [(at_s, gap) for at_s, gap in self.rows if now_s - at_s <= _COUNTS_S]
        if len(kept) < _LEAST or kept[-1][0] - kept[0][0] < _LASTS_S:
            return None
        gaps = [gap for _, gap in kept]
        middle = np.median(gaps, axis=0)
        size = math.hypot(*middle)
        steady = max(math.hypot(*(a - b)) for a, b in combinations(gaps, 2)) < 2.0 * _STEADY * size
        return middle if steady and size > _LEAST_M else None

    def is_jump(self, gap: Vector) -> bool:
        """Return whether the robot would have had to fly faster than possible."""
        return self.after_s <= _MOMENT_S and math.hypot(*gap) > _LEAST_M + self.after_s * ALONE_M_S


class TiedContradictions:
    """Call `take` with corrections, then `turns`. cameras: the fixed ones; robots: all."""

    def __init__(self, cameras: Collection[str], robots: Collection[str]) -> None:
        self._cameras, self._robots = frozenset(cameras), frozenset(robots)
        self._far: dict[Pair, _Contradiction] = {}
        self._agreed_s: dict[Pair, float] = {}

    def take(self, corrections: Iterable[Correction], now_s: float) -> None:
        """Take the corrections by sightings."""
        for c in corrections:
            pair = c.observer, c.subject
            if c.verdict is Verdict.ACCEPTED and not c.joined:
                self._agreed_s[pair] = now_s
                self._far.pop(pair, None)
            elif c.observer in self._cameras and c.subject in self._robots and c.reason in _CONTRADICTS:
                if pair not in self._far or self._far[pair].is_over(now_s):
                    self._far[pair] = _Contradiction(now_s, now_s - self._agreed(pair))
                self._far[pair].rows.append((now_s, np.array(c.residual[:3])))

    def turns(self, now_s: float, seen: Mapping[Pair, Vector]) -> Iterator[CameraTurn]:
        """Yield the cameras that were turned.

        seen: the last place of each robot in each fixed camera [m; camera_optical].
        """
        for camera in sorted({camera for camera, _ in self._far}):
            turn = self._turn(camera, now_s, seen)
            if turn is not None:
                self._far = {pair: far for pair, far in self._far.items() if pair[0] != camera}
                yield turn

    def _turn(self, camera: str, now_s: float, seen: Mapping[Pair, Vector]) -> CameraTurn | None:
        far = {robot: one for (by, robot), one in self._far.items() if by == camera and (by, robot) in seen}
        off = {robot: gap for robot, one in far.items() if (gap := one.lasting(now_s)) is not None}
        if not off:
            return None
        since_s = min(far[robot].since_s for robot in off)
        agreed_s = max(self._agreed((camera, robot)) for robot in self._robots)
        jumps = any(far[robot].is_jump(gap) for robot, gap in off.items())
        if agreed_s >= since_s or not (jumps or self._is_witnessed(off, now_s)):
            return None
        displaced = [Displacement(n, seen[camera, n] - gap, seen[camera, n]) for n, gap in off.items()]
        return camera_turn(camera, displaced, agreed_s)

    def _is_witnessed(self, off: Collection[str], now_s: float) -> bool:
        """Return whether two robots would have to be lost by the same amount."""
        if len(off) > 1:
            return True
        return any(self._are_tied(name, other, now_s) for name in off for other in self._robots if other != name)

    def _are_tied(self, one: str, other: str, now_s: float) -> bool:
        """Return whether one robot recently saw the other, or both saw one target, in the expected places."""
        seen_by = [
            {whom for who, whom in self._agreed_s if who == name and now_s - self._agreed((who, whom)) <= _TIED_S}
            for name in (one, other)
        ]
        return other in seen_by[0] or one in seen_by[1] or bool((seen_by[0] & seen_by[1]) - self._robots)

    def _agreed(self, pair: Pair) -> float:
        return self._agreed_s.get(pair, float("-inf"))
