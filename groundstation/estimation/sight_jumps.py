"""Finds fixed cameras whose whole picture jumps from one picture to the next. Pure.

A robot cannot jump. Its flight between two pictures is known from its own odometry, so a displacement that appears
between two pictures, and stays, is the camera's. The belief is not used: it may have followed the jump already.
"""

import math
from bisect import bisect_left
from collections import defaultdict, deque
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from groundstation.arrays import Array, Matrix, Vector
from groundstation.bus.messages import RelativeObservation
from groundstation.geometry.camera_turn import CameraTurn, Displacement, camera_turn
from groundstation.time_units import NS_PER_S

# Number of pictures before and after a jump; those of one side lie within this time, and the gap is no longer [s].
_BEFORE, _AFTER, _SIDE_S, _GAP_S = 3, 4, 0.6, 0.4
# Reported displacements: from this size [m], increased by the possible velocity error of a robot [m/s] over the gap.
# The odometry of one robot alone may have its largest possible error; those of two robots do not err alike.
_LEAST_M, ALONE_M_S, _TOGETHER_M_S = 0.06, 1.2, 0.3
# On each side of a jump sightings stay within this share of it; those of a drifting robot do not.
_STEADY = 0.3
_PATH = 120  # samples


@dataclass(frozen=True, slots=True)
class _Sight:
    """A marker in one picture [m; camera_optical], and the same less its robot's flight since the path began."""

    at_s: float
    seen: Vector
    held: Vector


class _Path:
    """A robot's path, integrated from its velocities [m; world]."""

    def __init__(self) -> None:
        self._times: deque[float] = deque(maxlen=_PATH)
        self._flown: deque[Array] = deque(maxlen=_PATH)

    def step(self, now_s: float, velocity: Sequence[float]) -> None:
        last = self._flown[-1] if self._flown else np.zeros(3)
        elapsed_s = now_s - self._times[-1] if self._times else 0.0
        self._times.append(now_s)
        self._flown.append(last + elapsed_s * np.asarray(velocity))

    def at(self, at_s: float) -> Array | None:
        """Return the displacement up to a time; None if unknown."""
        after = bisect_left(self._times, at_s)
        if not 0 < after < len(self._times):
            return None
        early, late = self._times[after - 1], self._times[after]
        share = (at_s - early) / (late - early)
        return self._flown[after - 1] + share * (self._flown[after] - self._flown[after - 1])


class SightJumps:
    """Call `see` with sightings, `fly` with the robots' velocities, then take `turns`. mounts: world_from_optical."""

    def __init__(self, mounts: Mapping[str, Matrix]) -> None:
        self._mounts = mounts
        self._paths: dict[str, _Path] = {}
        self._sights: defaultdict[str, dict[str, deque[_Sight]]] = defaultdict(dict)
        self._fresh: set[str] = set()

    def see(self, o: RelativeObservation) -> None:
        """Take a fixed camera's sighting of a robot."""
        at_s, path = o.header.stamp_ns / NS_PER_S, self._paths.get(o.subject)
        flown = None if path is None else path.at(at_s)
        if flown is None:
            return
        seen = np.array(o.position_m)
        rows = self._sights[o.observer].setdefault(o.subject, deque(maxlen=_BEFORE + _AFTER))
        # A momentarily frozen picture repeats, without news.
        if not rows or (at_s > rows[-1].at_s and not np.array_equal(seen, rows[-1].seen)):
            rows.append(_Sight(at_s, seen, seen - self._mounts[o.observer].T @ flown))
            self._fresh.add(o.observer)

    def fly(self, now_s: float, velocities: Mapping[str, Sequence[float]]) -> None:
        """Take the robots' velocities [m/s; world] from now on."""
        for name in self._paths.keys() - velocities.keys():
            self._forget(name)
        for name, velocity in velocities.items():
            self._paths.setdefault(name, _Path()).step(now_s, velocity)

    def turns(self) -> Iterator[CameraTurn]:
        """Yield the cameras turned recently, each once."""
        for camera in sorted(self._fresh):
            turn = self._turn(camera)
            if turn is not None:
                self._sights[camera].clear()
                yield turn
        self._fresh.clear()

    def _forget(self, robot: str) -> None:
        del self._paths[robot]
        for rows in self._sights.values():
            rows.pop(robot, None)

    def _turn(self, camera: str) -> CameraTurn | None:
        sights = self._sights[camera]
        for rows in sights.values():
            jump = _jump(rows) if len(rows) == _BEFORE + _AFTER else None
            if jump is None:
                continue
            began_s = rows[_BEFORE].at_s
            displaced = [
                Displacement(name, *shift) for name, others in sights.items() if (shift := _across(others, began_s))
            ]
            gap_s = began_s - rows[_BEFORE - 1].at_s
            together_m, alone_m = (_LEAST_M + gap_s * speed for speed in (_TOGETHER_M_S, ALONE_M_S))
            # A robot that does not jump beside one that does exonerates the camera: it hardly turned about exactly that
            # line of sight.
            together = len(displaced) > 1 and min(one.size_m for one in displaced) > together_m
            if together or (len(displaced) == 1 and jump > alone_m):
                return camera_turn(camera, displaced, rows[_BEFORE - 1].at_s)
        return None


def _jump(rows: Sequence[_Sight]) -> float | None:
    """Return the size of a sight's jump [m], if it jumped between two pictures and stayed."""
    before, after = list(rows)[:_BEFORE], list(rows)[_BEFORE:]
    gap_s = after[0].at_s - before[-1].at_s
    if gap_s > _GAP_S or after[-1].at_s - after[0].at_s > _SIDE_S or before[-1].at_s - before[0].at_s > _SIDE_S:
        return None
    old, new = _middle(before), _middle(after)
    size = math.hypot(*(new - old))
    wide = max(math.hypot(*(one.held - at)) for side, at in ((before, old), (after, new)) for one in side)
    return size if size > _LEAST_M and wide < _STEADY * size else None


def _across(rows: Sequence[_Sight], began_s: float) -> tuple[Vector, Vector] | None:
    """Return the expected and the actual place of a sight after a time; None if it was not seen on both sides."""
    before = [one for one in rows if 0.0 < began_s - one.at_s <= _SIDE_S]
    after = [one for one in rows if 0.0 <= one.at_s - began_s <= _SIDE_S]
    if min(len(before), len(after)) < _BEFORE:
        return None
    old, new = _middle(before), _middle(after)
    seen = np.asarray(after[len(after) // 2].seen)
    return seen - (new - old), seen


def _middle(side: Sequence[_Sight]) -> Vector:
    """Return the place of a sight on one side of a jump, less its robot's flight [m; camera_optical]."""
    return np.asarray(np.median([one.held for one in side], axis=0))
