"""Loops of sightings: where two ways through the team's cameras lead to one marker, figures that are wrong show. Pure.

A fixed camera tells where the drones are, and each drone where it sees a marker. What is wrong shows in the height of a
target, in the places and headings that two drones tell of one target, and in those that a drone and the fixed camera
tell of another drone. No filter is asked: what a filter has explained away is still there.
"""

import math
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from groundstation.arrays import Array, Vector
from groundstation.bus.messages import RelativeObservation
from groundstation.estimation.attitude_intake import Lean
from groundstation.field.resolved import ResolvedField
from groundstation.geometry.rotations import (
    base_from_tilted_optical,
    rotation_from_euler,
    rotation_z,
    world_from_downward_optical,
)
from groundstation.time_units import NS_PER_S

Key = tuple[str, str]
"""A figure: whose ("": of all), and which."""

CARRIED, FIXED = ("pan", "tilt", "focal", "delay"), ("z", "roll", "pitch", "focal", "delay")
"""Figures of a drone's camera, and those of a fixed one that change what the team sees of itself."""

ALL_PRINTS: Key = ("", "print")
# Two sightings of one marker this far apart [s] are joined by a line; the second may be late; of one marker by one
# drone no more than one in so long is used: more tell nothing new.
_APART_S, _LAG_S, _SPACING_S, _AT_ONCE_S = 0.2, 0.6, 0.12, 0.04
_KEPT, _MOST_DRONES = 40, 6
# Derivatives by a delay are taken over as much before as after: over less, noise would be motion, and a lean that
# begins would look like motion of the target.
_STEP, _STEPS_S = 1e-4, 0.25
# Of one second's median: a detector's own bias of place and of heading, and a lean that is another one than told.
_BIAS_M, _HEADING_RAD, _LEAN_RAD = 0.008, math.radians(1.0), math.radians(0.8)
# Of one loop about that median, of places and of headings (studies: 6 to 11 mm, 0.3 to 1.5 deg).
_JITTER_M, _JITTER_RAD = 0.012, math.radians(1.2)
# Farther apart, a heading is not that of a camera which looks a little aside.
_HEADING, _MOST_TURNED_RAD = 3, math.radians(20.0)


@dataclass(frozen=True, slots=True)
class Gap:
    """One loop: how far its two ways are apart (m) [m or, of headings, rad; world], and by each figure (m, n).

    std: of a second's median; jitter: of one loop about it; name: the same for the same cameras and marker.
    """

    name: str
    at_s: float
    apart: Vector
    by_figure: Array
    std: float
    jitter: float


@dataclass(frozen=True, slots=True)
class _Stand:
    """A drone's marker by a fixed camera [camera_optical], and its heading."""

    at_s: float
    position: Vector
    yaw: float


@dataclass(frozen=True, slots=True)
class _Point:
    """Pose (x, y, z, heading) [m, rad; world] that a drone tells of a marker, heading NaN if unknown; slopes (4, n)."""

    at_s: float
    pose: Vector
    slopes: Array
    far_m: float


@dataclass(frozen=True, slots=True)
class _Moving:
    """A point, and how fast it moves [m/s; world] (2)."""

    point: _Point
    rate: Vector


@dataclass(frozen=True, slots=True)
class _Sight:
    """A sighting by a drone, and how that leans."""

    at_s: float
    seen: RelativeObservation
    lean: Lean


class SightLoops:
    """Takes sightings as they come; `gaps` returns the loops that have closed. Follows six drones at most."""

    def __init__(self, field: ResolvedField) -> None:
        self._drones = dict(list(field.drones.items())[:_MOST_DRONES])
        self._heights = {name: target.marker.height_m for name, target in field.tracked.items()}
        self._fixed = {
            name: (world_from_downward_optical(c.rotation_deg), np.array(c.position_m))
            for name, c in field.cameras.items()
        }
        self.keys: tuple[Key, ...] = (
            ALL_PRINTS,
            *((name, "print") for name in (*self._drones, *self._heights)),
            *((name, part) for name in self._drones for part in CARRIED),
            *((name, part) for name in self._fixed for part in FIXED),
        )
        self._index = {key: i for i, key in enumerate(self.keys)}
        self._stands: dict[tuple[str, str], deque[_Stand]] = {}
        self._points: dict[tuple[str, str, str], deque[_Point]] = {}
        self._unpaired: deque[tuple[tuple[str, str, str], _Point]] = deque(maxlen=500)
        self._waiting: deque[_Sight] = deque(maxlen=500)
        self.levelled: set[str] = set()
        """Drones of whose newest sighting the lean was told by an IMU."""
        self._used_s: dict[tuple[str, str], float] = {}

    def see(self, o: RelativeObservation, lean: Lean) -> None:
        """Take a sighting, and how its observer leans."""
        at_s = o.header.stamp_ns / NS_PER_S
        if o.observer in self._fixed:
            if o.subject in self._drones and o.yaw_rad is not None:
                rows = self._stands.setdefault((o.observer, o.subject), deque(maxlen=_KEPT))
                rows.append(_Stand(at_s, np.array(o.position_m), o.yaw_rad))
            return
        known = o.observer in self._drones and (o.subject in self._drones or o.subject in self._heights)
        if known and at_s - self._used_s.get((o.observer, o.subject), -math.inf) >= _SPACING_S:
            self._used_s[o.observer, o.subject] = at_s
            (self.levelled.add if lean.by_imu else self.levelled.discard)(o.observer)
            self._waiting.append(_Sight(at_s, o, lean))

    def gaps(self, now_s: float) -> Iterator[Gap]:
        """Yield the loops of drones' sightings that are old enough to have neighbours on both sides."""
        while self._waiting and self._waiting[0].at_s < now_s - _LAG_S:
            sight = self._waiting.popleft()
            o = sight.seen
            for camera in self._fixed:
                point = self._point(camera, sight)
                if point is None:
                    continue
                if o.subject in self._drones:
                    yield from self._to_drone(camera, o, point)
                else:
                    yield from self._to_target(camera, o, point)
        while self._unpaired and self._unpaired[0][1].at_s < now_s - _LAG_S - 2.0 * _STEPS_S:
            yield from self._pair(*self._unpaired.popleft())

    def _point(self, camera: str, sight: _Sight) -> _Point | None:
        at_s, o = sight.at_s, sight.seen

        def seen(theta: Vector) -> Vector | None:
            return self._seen(camera, sight, theta)

        pose = seen(np.zeros(len(self.keys)))
        if pose is None:
            return None
        return _Point(at_s, pose, self._slopes(seen, pose, camera, o), math.hypot(*o.position_m))

    def _to_drone(self, camera: str, o: RelativeObservation, point: _Point) -> Iterator[Gap]:
        def marker(theta: Vector) -> Vector | None:
            at_s = point.at_s - float(theta[self._index[o.observer, "delay"]])
            placed = self._placed(camera, o.subject, at_s, theta)
            return None if placed is None else np.append(placed[2], placed[1])

        other = marker(np.zeros(len(self.keys)))
        if other is not None:
            there = _Point(point.at_s, other, self._slopes(marker, other, camera, o), point.far_m)
            yield from _gaps(f"{camera} {o.observer} {o.subject}", point, there, (0, 1, 2))

    def _to_target(self, camera: str, o: RelativeObservation, point: _Point) -> Iterator[Gap]:
        board = np.array([0.0, 0.0, self._heights[o.subject], math.nan])
        floor = _Point(point.at_s, board, np.zeros_like(point.slopes), point.far_m)
        yield from _gaps(f"{camera} {o.observer} {o.subject} height", point, floor, (2,))
        own = (camera, o.observer, o.subject)
        self._points.setdefault(own, deque(maxlen=_KEPT)).append(point)
        self._unpaired.append((own, point))

    def _pair(self, own: tuple[str, str, str], point: _Point) -> Iterator[Gap]:
        camera, observer, subject = own
        for way, others in self._points.items():
            if way[0] == camera and way[2] == subject and way != own:
                other = _between(others, point.at_s)
                if other is not None:
                    both = self._at_one_time(point, observer, other, way[1])
                    first, second = both if observer < way[1] else both[::-1]
                    name = f"{camera} {min(observer, way[1])} {max(observer, way[1])} {subject}"
                    yield from _gaps(name, first, second, (0, 1))
                    return

    def _at_one_time(self, point: _Point, observer: str, other: _Moving, rival: str) -> tuple[_Point, _Point]:
        """Return two drones' points of one target where a camera's delay also tells of another time of the target."""
        found = []
        for one, name in ((point, observer), (other.point, rival)):
            slopes = one.slopes.copy()
            slopes[:2, self._index[name, "delay"]] += other.rate
            found.append(replace(one, slopes=slopes))
        return found[0], found[1]

    def _slopes(
        self, of: Callable[[Vector], Vector | None], here: Vector, camera: str, o: RelativeObservation
    ) -> Array:
        """Return derivatives (4, n) by differences, for the figures of those who take part."""
        slopes = np.zeros((4, len(self.keys)))
        for (who, part), column in self._index.items():
            if who in ("", camera, o.observer, o.subject):
                theta = np.zeros(len(self.keys))
                theta[column] = step = _STEPS_S if part == "delay" else _STEP
                there, before = of(theta), of(-theta) if part == "delay" else here
                if there is not None and before is not None:
                    slopes[:, column] = _difference(there, before) / (2.0 * step if part == "delay" else step)
        return slopes

    def _scale(self, name: str, theta: Vector) -> float:
        return float((1.0 + theta[0]) * (1.0 + theta[self._index[name, "print"]]))

    def _placed(self, camera: str, drone: str, at_s: float, theta: Vector) -> tuple[Vector, float, Vector] | None:
        """Return base [m; world], heading and marker's centre of a drone at a true time, by a fixed camera."""
        wanted = at_s + float(theta[self._index[camera, "delay"]])
        for a, b in pairwise(self._stands.get((camera, drone), ())):
            if a.at_s <= wanted <= b.at_s and 0.0 < b.at_s - a.at_s <= _APART_S:
                break
        else:
            return None
        share = (wanted - a.at_s) / (b.at_s - a.at_s)
        yaw = a.yaw + share * math.remainder(b.yaw - a.yaw, math.tau)
        rotation, place = self._fixed[camera]
        z, roll, pitch, focal = (float(theta[self._index[camera, part]]) for part in FIXED[:4])
        optical = (a.position + share * (b.position - a.position)) * self._scale(drone, theta)
        optical[2] *= 1.0 + focal
        centre = rotation_from_euler(roll, pitch, 0.0) @ (rotation @ optical) + place + (0.0, 0.0, z)
        return centre - rotation_z(yaw) @ np.array(self._drones[drone].marker.position_m), yaw, centre

    def _seen(self, camera: str, sight: _Sight, theta: Vector) -> Vector | None:
        """Return where a drone tells a marker to be [m; world], and its heading."""
        o = sight.seen
        pan, tilt, focal, delay = (float(theta[self._index[o.observer, part]]) for part in CARRIED)
        placed = self._placed(camera, o.observer, sight.at_s - delay, theta)
        if placed is None:
            return None
        base, yaw, _ = placed
        eye = self._drones[o.observer].camera
        optical = np.array(o.position_m) * self._scale(o.subject, theta)
        optical[2] *= 1.0 + focal
        rotation = base_from_tilted_optical(
            math.radians(eye.tilt_down_deg) + tilt, math.radians(eye.pan_left_deg) + pan
        )
        lean = sight.lean
        leaning = rotation_from_euler(
            lean.roll_rad - delay * lean.roll_rate, lean.pitch_rad - delay * lean.pitch_rate, yaw
        )
        centre = base + leaning @ (rotation @ optical + np.array(eye.position_m))
        return np.append(centre, math.nan if o.yaw_rad is None else yaw + pan + o.yaw_rad)


def _between(rows: Sequence[_Point], at_s: float) -> _Moving | None:
    """Return a point at a time between two others."""
    for a, b in pairwise(rows):
        if a.at_s <= at_s <= b.at_s and 0.0 < b.at_s - a.at_s <= _APART_S:
            pose = a.pose + (at_s - a.at_s) / (b.at_s - a.at_s) * _difference(b.pose, a.pose)
            return _Moving(_Point(at_s, pose, a.slopes, max(a.far_m, b.far_m)), _rate(rows, at_s))
    return _Moving(rows[-1], _rate(rows, at_s)) if rows and abs(rows[-1].at_s - at_s) < _AT_ONCE_S else None


def _rate(rows: Sequence[_Point], at_s: float) -> Vector:
    """Return how fast points move [m/s; world] (2), 0 where too few were seen about a time."""
    near = [row for row in rows if abs(row.at_s - at_s) < 2.0 * _STEPS_S]
    if not near or min(at_s - near[0].at_s, near[-1].at_s - at_s) < _STEPS_S:
        return np.zeros(2)
    return np.asarray((near[-1].pose - near[0].pose)[:2] / (near[-1].at_s - near[0].at_s))


def _gaps(name: str, first: _Point, second: _Point, places: tuple[int, ...]) -> Iterator[Gap]:
    """Yield how far two points are apart in entries of their places, and in their headings where both tell one."""
    apart, slopes = _difference(first.pose, second.pose), first.slopes - second.slopes
    kept = list(places)
    std = math.hypot(_BIAS_M, _LEAN_RAD * max(first.far_m, second.far_m))
    yield Gap(name, first.at_s, apart[kept], slopes[kept], std, _JITTER_M)
    if abs(apart[_HEADING]) < _MOST_TURNED_RAD:  # NaN is not
        yield Gap(f"{name} heading", first.at_s, apart[_HEADING:], slopes[_HEADING:], _HEADING_RAD, _JITTER_RAD)


def _difference(there: Vector, here: Vector) -> Vector:
    apart = there - here
    if not math.isnan(apart[_HEADING]):
        apart[_HEADING] = math.remainder(apart[_HEADING], math.tau)
    return apart
