"""Loops of sightings: where two ways through the team's cameras lead to one marker, figures that are wrong show. Pure.

A fixed camera tells where the drones are, and each drone where it sees a marker. What is wrong shows in the height of a
target, in the places that two drones tell of one target, and in those that a drone and the fixed camera tell of another
drone. No filter is asked: what a filter has explained away is still there.
"""

import math
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from groundstation.arrays import Array, Vector
from groundstation.bus.messages import RelativeObservation
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

CARRIED = ("pan", "tilt", "focal", "delay")
ALL_PRINTS: Key = ("", "print")
# Two sightings of one marker this far apart [s] are joined by a line; the second may be late; of one marker by one
# drone no more than one in so long is used: more tell nothing new.
_APART_S, _LAG_S, _SPACING_S, _AT_ONCE_S = 0.2, 0.6, 0.12, 0.04
_KEPT, _MOST_DRONES = 40, 6
_STEP = 1e-4


@dataclass(frozen=True, slots=True)
class Gap:
    """One loop: how far its two ways are apart (m) [m; world], and by each figure (m, n); far_m: its longest sighting.

    name: the same for the same cameras and marker.
    """

    name: str
    at_s: float
    gap_m: Vector
    by_figure: Array
    far_m: float


@dataclass(frozen=True, slots=True)
class _Stand:
    """A drone's marker by a fixed camera [camera_optical], and its heading."""

    at_s: float
    position: Vector
    yaw: float


@dataclass(frozen=True, slots=True)
class _Point:
    """Where a drone tells a target's marker to be [m; world], with derivatives (3, n)."""

    at_s: float
    place: Vector
    slopes: Array
    far_m: float


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
            *((name, "delay") for name in self._fixed),
        )
        self._index = {key: i for i, key in enumerate(self.keys)}
        self._stands: dict[tuple[str, str], deque[_Stand]] = {}
        self._points: dict[tuple[str, str, str], deque[_Point]] = {}
        self._waiting: deque[tuple[float, RelativeObservation]] = deque(maxlen=500)
        self._used_s: dict[tuple[str, str], float] = {}

    def see(self, o: RelativeObservation) -> None:
        """Take a sighting."""
        at_s = o.header.stamp_ns / NS_PER_S
        if o.observer in self._fixed:
            if o.subject in self._drones and o.yaw_rad is not None:
                rows = self._stands.setdefault((o.observer, o.subject), deque(maxlen=_KEPT))
                rows.append(_Stand(at_s, np.array(o.position_m), o.yaw_rad))
            return
        known = o.observer in self._drones and (o.subject in self._drones or o.subject in self._heights)
        if known and at_s - self._used_s.get((o.observer, o.subject), -math.inf) >= _SPACING_S:
            self._used_s[o.observer, o.subject] = at_s
            self._waiting.append((at_s, o))

    def gaps(self, now_s: float) -> Iterator[Gap]:
        """Yield the loops of drones' sightings that are old enough to have neighbours on both sides."""
        while self._waiting and self._waiting[0][0] < now_s - _LAG_S:
            at_s, o = self._waiting.popleft()
            for camera in self._fixed:
                point = self._point(camera, at_s, o)
                if point is None:
                    continue
                if o.subject in self._drones:
                    yield from self._to_drone(camera, o, point)
                else:
                    yield from self._to_target(camera, o, point)

    def _point(self, camera: str, at_s: float, o: RelativeObservation) -> _Point | None:
        def seen(theta: Vector) -> Vector | None:
            return self._seen(camera, at_s, o, theta)

        place = seen(np.zeros(len(self.keys)))
        if place is None:
            return None
        return _Point(at_s, place, self._slopes(seen, place, camera, o), math.hypot(*o.position_m))

    def _to_drone(self, camera: str, o: RelativeObservation, point: _Point) -> Iterator[Gap]:
        def marker(theta: Vector) -> Vector | None:
            placed = self._placed(camera, o.subject, point.at_s, theta)
            return None if placed is None else placed[2]

        other = marker(np.zeros(len(self.keys)))
        if other is not None:
            slopes = point.slopes - self._slopes(marker, other, camera, o)
            yield Gap(f"{camera} {o.observer} {o.subject}", point.at_s, point.place - other, slopes, point.far_m)

    def _to_target(self, camera: str, o: RelativeObservation, point: _Point) -> Iterator[Gap]:
        above = (point.place - self._heights[o.subject])[2:]
        yield Gap(f"{camera} {o.observer} {o.subject} height", point.at_s, above, point.slopes[2:], point.far_m)
        own = (camera, o.observer, o.subject)
        self._points.setdefault(own, deque(maxlen=_KEPT)).append(point)
        for way, others in self._points.items():
            if way[0] == camera and way[2] == o.subject and way != own:
                other = _between(others, point.at_s)
                if other is not None:
                    first, second = (point, other) if o.observer < way[1] else (other, point)
                    name = f"{camera} {min(o.observer, way[1])} {max(o.observer, way[1])} {o.subject}"
                    apart, slopes = (first.place - second.place)[:2], (first.slopes - second.slopes)[:2]
                    yield Gap(name, point.at_s, apart, slopes, max(point.far_m, other.far_m))
                    return

    def _slopes(
        self, of: Callable[[Vector], Vector | None], here: Vector, camera: str, o: RelativeObservation
    ) -> Array:
        """Return derivatives (3, n) by differences, for the figures of those who take part."""
        slopes = np.zeros((3, len(self.keys)))
        for (who, _), column in self._index.items():
            if who in ("", camera, o.observer, o.subject):
                theta = np.zeros(len(self.keys))
                theta[column] = _STEP
                there = of(theta)
                if there is not None:
                    slopes[:, column] = (there - here) / _STEP
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
        centre = rotation @ ((a.position + share * (b.position - a.position)) * self._scale(drone, theta)) + place
        return centre - rotation_z(yaw) @ np.array(self._drones[drone].marker.position_m), yaw, centre

    def _seen(self, camera: str, at_s: float, o: RelativeObservation, theta: Vector) -> Vector | None:
        """Return where a drone tells a marker to be [m; world]."""
        pan, tilt, focal, delay = (float(theta[self._index[o.observer, part]]) for part in CARRIED)
        placed = self._placed(camera, o.observer, at_s - delay, theta)
        if placed is None:
            return None
        base, yaw, _ = placed
        eye = self._drones[o.observer].camera
        optical = np.array(o.position_m) * self._scale(o.subject, theta)
        optical[2] *= 1.0 + focal
        rotation = base_from_tilted_optical(
            math.radians(eye.tilt_down_deg) + tilt, math.radians(eye.pan_left_deg) + pan
        )
        leaning = rotation_from_euler(o.roll_rad, o.pitch_rad, yaw)
        return np.asarray(base + leaning @ (rotation @ optical + np.array(eye.position_m)))


def _between(rows: Sequence[_Point], at_s: float) -> _Point | None:
    """Return a point at a time between two others, or the last one if it is of that time."""
    for a, b in pairwise(rows):
        if a.at_s <= at_s <= b.at_s and 0.0 < b.at_s - a.at_s <= _APART_S:
            share = (at_s - a.at_s) / (b.at_s - a.at_s)
            place = a.place + share * (b.place - a.place)
            return _Point(at_s, place, a.slopes, max(a.far_m, b.far_m))
    return rows[-1] if rows and abs(rows[-1].at_s - at_s) < _AT_ONCE_S else None
