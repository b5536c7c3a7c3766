"""Fixed cameras that contradict robots which agree among each other. Pure.

A robot that nobody saw for a while may be lost, and is believed to be where the camera sees it. Two that see each
other, or one target, where they should be, cannot be lost in the same manner: then the camera is.
"""

import math
from collections import deque
from collections.abc import Collection, Iterable, Iterator, Mapping
from itertools import combinations

import numpy as np

from groundstation.arrays import Vector
from groundstation.bus.messages import Verdict
from groundstation.estimation.event_log import FAR, HASTY
from groundstation.estimation.measurement import Correction
from groundstation.geometry.camera_turn import CameraTurn, Displacement, camera_turn

# A contradiction counts for so long, so many at least over so long, all by the same amount but for a share of it.
_COUNTS_S, _LEAST, _LASTS_S, _STEADY = 1.5, 4, 0.3, 0.3
_TIED_S, _AGREES_S = 1.0, 1.0
_LEAST_M = 0.15

Pair = tuple[str, str]


class TiedContradictions:
    """Use: `take` corrections, then `turns`. cameras: the fixed ones; robots: all."""

    def __init__(self, cameras: Collection[str], robots: Collection[str]) -> None:
        self._cameras, self._robots = frozenset(cameras), frozenset(robots)
        self._far: dict[Pair, deque[tuple[float, Vector]]] = {}
        self._agreed_s: dict[Pair, float] = {}

    def take(self, corrections: Iterable[Correction], now_s: float) -> None:
        """Take what became of sightings."""
        for c in corrections:
            pair = c.observer, c.subject
            if c.verdict is Verdict.ACCEPTED and not c.joined:
                self._agreed_s[pair] = now_s
                self._far.pop(pair, None)
            elif c.observer in self._cameras and c.subject in self._robots and c.reason in (FAR, HASTY):
                self._far.setdefault(pair, deque(maxlen=15)).append((now_s, np.array(c.residual[:3])))

    def turns(self, now_s: float, seen: Mapping[Pair, Vector]) -> Iterator[CameraTurn]:
        """Yield the cameras that were turned. seen: where each fixed camera saw each robot last [m; camera_optical]."""
        for camera in sorted({camera for camera, _ in self._far}):
            turn = self._turn(camera, now_s, seen)
            if turn is not None:
                self._far = {pair: rows for pair, rows in self._far.items() if pair[0] != camera}
                yield turn

    def _turn(self, camera: str, now_s: float, seen: Mapping[Pair, Vector]) -> CameraTurn | None:
        off = {
            pair[1]: gap
            for pair, rows in self._far.items()
            if pair[0] == camera and pair in seen and (gap := _lasting(rows, now_s)) is not None
        }
        agrees = any(self._lately((camera, robot), now_s, _AGREES_S) for robot in self._robots)
        if not off or agrees or not self._is_witnessed(off, now_s):
            return None
        return camera_turn(camera, [Displacement(n, seen[camera, n] - gap, seen[camera, n]) for n, gap in off.items()])

    def _is_witnessed(self, off: Collection[str], now_s: float) -> bool:
        """Return whether two robots would have to be lost in the same manner."""
        if len(off) > 1:
            return True
        return any(self._are_tied(name, other, now_s) for name in off for other in self._robots if other != name)

    def _are_tied(self, one: str, other: str, now_s: float) -> bool:
        """Return whether one robot lately saw the other, or both one target, where they should be."""
        seen_by = [
            {whom for who, whom in self._agreed_s if who == name and self._lately((who, whom), now_s, _TIED_S)}
            for name in (one, other)
        ]
        return other in seen_by[0] or one in seen_by[1] or bool((seen_by[0] & seen_by[1]) - self._robots)

    def _lately(self, pair: Pair, now_s: float, within_s: float) -> bool:
        return now_s - self._agreed_s.get(pair, float("-inf")) <= within_s


def _lasting(rows: Iterable[tuple[float, Vector]], now_s: float) -> Vector | None:
    """Return by how much a robot is contradicted [m; camera_optical], if lastingly and by one and the same amount."""
    kept = [(at_s, gap) for at_s, gap in rows if now_s - at_s <= _COUNTS_S]
    if len(kept) < _LEAST or kept[-1][0] - kept[0][0] < _LASTS_S:
        return None
    gaps = [gap for _, gap in kept]
    middle = np.median(gaps, axis=0)
    size = math.hypot(*middle)
    steady = max(math.hypot(*(a - b)) for a, b in combinations(gaps, 2)) < 2.0 * _STEADY * size
    return middle if steady and size > _LEAST_M else None
