"""Judges whether poses of a motion capture system can be true: frozen, jumped, turned, exchanged bodies. Pure."""

import math
from collections.abc import Iterator, Mapping, Set
from dataclasses import dataclass, field
from itertools import combinations

import numpy as np

from drivers.motion_capture.convert import EntityPose
from groundstation.arrays import Array
from groundstation.time_units import NS_PER_S
from groundstation.vectors import Vector3, difference

# A standing marker jitters by tenths of a millimetre from frame to frame; exact repeats are no measurements.
_FROZEN_S, _FROZEN_FRAMES = 0.2, 5
# Allowance for noise and one lost frame in a body's motion between two frames.
_MARGIN_M = 0.05
# Jumps that add up to less than this have led back to the start.
_BACK_M = 0.15
# No body turns faster, but for a drone that leans; nor does noise turn it. Turns that add up to less led back.
_TURN_RAD_S, _LEAN_RAD, _BACK_RAD = 5.0, math.radians(30.0), math.radians(25.0)
# A body out of sight for this long may be anywhere, and may have been renamed.
_FORGOTTEN_S = 1.0


@dataclass(slots=True)
class _Track:
    """One body: its last pose, since when it has repeated exactly, and the sums of its jumps [m] and of its turns."""

    stamp_ns: int
    position: Vector3
    rotation: Array
    since_ns: int
    repeats: int = 0
    offset: Vector3 = (0.0, 0.0, 0.0)
    jumped_m: float = 0.0
    turn: Array = field(default_factory=lambda: np.eye(3))
    turned_rad: float = 0.0


@dataclass(slots=True)
class BodyWatch:
    """Follows all bodies of one system from frame to frame; max_speed_m_s: no body moves faster."""

    max_speed_m_s: float
    _tracks: dict[str, _Track] = field(default_factory=dict)
    _exchanged: set[frozenset[str]] = field(default_factory=set)

    @property
    def names(self) -> Set[str]:
        """Return the bodies on which its judgement still depends."""
        return self._tracks.keys() | {name for pair in self._exchanged for name in pair}

    def look(self, stamp_ns: int, poses: Mapping[str, EntityPose]) -> dict[str, str]:
        """Take in the bodies of a frame; return for each why it must not be used, or ""; stamp_ns: the frame's."""
        self._forget(stamp_ns)
        positions = {name: pose.position for name, pose in poses.items()}
        before = {name: track.position for name, track in self._tracks.items()}
        reach_m = {name: self._reach_m(self._tracks[name], poses[name].exposure_ns) for name in poses if name in before}
        jumped = {
            name: difference(position, before[name])
            for name, position in positions.items()
            if name in reach_m and math.dist(before[name], position) > reach_m[name]
        }
        turned = {name: turn for name, pose in poses.items() if (turn := self._turn(name, pose)) is not None}
        for pair in list(_exchanges(jumped, before, positions, reach_m)):
            self._exchanged ^= {pair}
            for name in pair:
                jumped.pop(name, None)
                turned.pop(name, None)
        for name, pose in poses.items():
            self._follow(name, pose, jumped.get(name), turned.get(name))
        return {name: self._fault(name) for name in positions}

    def _forget(self, stamp_ns: int) -> None:
        gone = [n for n, track in self._tracks.items() if stamp_ns - track.stamp_ns > _FORGOTTEN_S * NS_PER_S]
        for name in gone:
            del self._tracks[name]
        # While one of a pair is in sight under the other's name, the second has no name but the first's.
        self._exchanged = {pair for pair in self._exchanged if pair & self._tracks.keys()}

    def _reach_m(self, track: _Track, stamp_ns: int) -> float:
        """Return how far a body may have moved since its last new pose [m]: it flies on while that is frozen."""
        return self.max_speed_m_s * max(0, stamp_ns - track.since_ns) / NS_PER_S + _MARGIN_M

    def _turn(self, name: str, pose: EntityPose) -> Array | None:
        """Return how a body turned in its own axes (3, 3) since its last pose, if it cannot have; else None."""
        track = self._tracks.get(name)
        if track is None:
            return None
        turn: Array = track.rotation.T @ pose.rotation
        reach_rad = _TURN_RAD_S * max(0, pose.exposure_ns - track.since_ns) / NS_PER_S + _LEAN_RAD
        return turn if _angle_rad(turn) > reach_rad else None

    def _follow(self, name: str, pose: EntityPose, jump: Vector3 | None, turn: Array | None) -> None:
        stamp_ns, position = pose.exposure_ns, pose.position
        track = self._tracks.setdefault(name, _Track(stamp_ns, position, pose.rotation, stamp_ns))
        if position == track.position:
            track.repeats += 1
        else:
            track.repeats, track.since_ns = 0, stamp_ns
        if jump is not None:
            x, y, z = track.offset
            track.offset = (x + jump[0], y + jump[1], z + jump[2])
            track.jumped_m = math.hypot(*track.offset)
        if turn is not None:
            track.turn = track.turn @ turn
            track.turned_rad = _angle_rad(track.turn)
        track.stamp_ns, track.position, track.rotation = stamp_ns, position, pose.rotation

    def _fault(self, name: str) -> str:
        track = self._tracks[name]
        if track.repeats >= _FROZEN_FRAMES and track.stamp_ns - track.since_ns >= _FROZEN_S * NS_PER_S:
            return "its pose repeats to the last bit: the stream is frozen"
        for pair in self._exchanged:
            if name in pair:
                (other,) = pair - {name}
                return f"its name was exchanged with that of {other} in flight"
        if track.jumped_m > _BACK_M:
            return f"jumped by {track.jumped_m:.2f} m from one frame to the next"
        if track.turned_rad > _BACK_RAD:
            return f"turned by {math.degrees(track.turned_rad):.0f} deg from one frame to the next"
        return "lies upside down by its pose" if track.rotation[2, 2] < 0.0 else ""


def _angle_rad(rotation: Array) -> float:
    return math.acos(min(1.0, max(-1.0, 0.5 * (float(np.trace(rotation)) - 1.0))))


def _exchanges(
    jumped: Mapping[str, Vector3],
    before: Mapping[str, Vector3],
    now: Mapping[str, Vector3],
    reach_m: Mapping[str, float],
) -> Iterator[frozenset[str]]:
    """Yield the pairs of bodies that jumped to each other's places."""
    for a, b in combinations(sorted(jumped), 2):
        if math.dist(now[a], before[b]) <= reach_m[b] and math.dist(now[b], before[a]) <= reach_m[a]:
            yield frozenset((a, b))
