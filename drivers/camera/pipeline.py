"""One camera's eyes without its wires: picture and attitudes in, sightings out; keeps the tracks between pictures."""

from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from drivers.camera import detect, markers, pose
from drivers.camera.search import search
from drivers.camera.settings import DetectorSettings, MarkerSettings
from drivers.camera.tracks import Track
from groundstation.geometry.board import Board
from groundstation.geometry.lens import CameraIntrinsics

Array = NDArray[np.float64]
Picture = NDArray[np.uint8]
_NS = 1_000_000_000
# Corners beside a tracked board, its bar's among them, are no new board.
_TAKEN_SQUARES = 2.2


@dataclass(frozen=True, slots=True)
class Sighting:
    """An identified marker in one picture; corners (12, 2) [px]."""

    entity: str
    margin: float
    choice: pose.PoseChoice
    corners: Array


GravityOf = Callable[[str], pose.Gravity]


class Pipeline:
    """Finds, follows, identifies and measures the expected markers of one camera.

    `counts` says what was found, missed and refused since the start, by name.
    """

    def __init__(
        self,
        intrinsics: CameraIntrinsics,
        expected: tuple[MarkerSettings, ...],
        settings: DetectorSettings,
        search_rate_hz: float,
        search_phase_s: float = 0.0,
    ) -> None:
        self._intrinsics = intrinsics
        self._settings = settings
        self._expected = {marker.code: marker for marker in expected}
        self._points = {marker.code: Board(marker.code, marker.square_mm).corners() for marker in expected}
        self._search_rate_hz = search_rate_hz
        self._search_phase_ns = round(search_phase_s * _NS)
        self._next_search_ns: int | None = None
        self._tracks: list[Track] = []
        self.counts: Counter[str] = Counter()

    @property
    def tracked(self) -> tuple[str, ...]:
        """Return the entities in view."""
        return tuple(self._expected[track.code].entity for track in self._tracks if track.code in self._expected)

    def process(self, picture: Picture, stamp_ns: int, gravity_of: GravityOf) -> list[Sighting]:
        """Return the sightings in a picture exposed at `stamp_ns`; gravity_of gives what is known for a subject."""
        finds = self._follow(picture, stamp_ns)
        if self._is_search_due(stamp_ns):
            finds += self._search(picture, stamp_ns)
            self._schedule_search(stamp_ns)
        sightings = []
        for track, find in finds:
            track.identify(markers.read_bar(picture, find, self._intrinsics), stamp_ns, self._settings.identity_margin)
            sighting = self._measure(track, gravity_of)
            if sighting is not None:
                sightings.append(sighting)
        self._tracks = [track for track in self._tracks if not self._is_over(track, stamp_ns)]
        return self._unique(sightings)

    def _follow(self, picture: Picture, stamp_ns: int) -> list[tuple[Track, detect.Find]]:
        finds: list[tuple[Track, detect.Find]] = []
        for track in self._tracks:
            window = track.window(stamp_ns, picture.shape)
            find = detect.find_board(picture, window, detect.spacing_px(track.corners)) if window else None
            if find is None or not track.accepts(find, stamp_ns) or self._is_taken(find, finds):
                track.miss()
                self.counts["missed"] += 1
                continue
            track.follow(find, stamp_ns)
            self.counts["followed"] += 1
            finds.append((track, find))
        return finds

    def _search(self, picture: Picture, stamp_ns: int) -> list[tuple[Track, detect.Find]]:
        taken = []
        for track in self._tracks:
            if track.misses == 0:
                margin_px = _TAKEN_SQUARES * detect.spacing_px(track.corners)
                window = detect.window_around(track.corners, margin_px, picture.shape)
                taken += [window] if window else []
        known = [(track, detect.Find(track.corners, 0.0, 0.0)) for track in self._tracks if track.misses == 0]
        finds = [find for find in search(picture, taken) if not self._is_taken(find, known)]
        fresh = [(Track(find.corners, stamp_ns), find) for find in finds]
        # A board that is found again replaces the track that had missed it.
        self._tracks = [t for t in self._tracks if t.misses == 0 or not self._is_taken_by(t, fresh)]
        self._tracks += [track for track, _ in fresh]
        self.counts["searches"] += 1
        self.counts["found"] += len(fresh)
        return fresh

    def _is_taken_by(self, track: Track, fresh: list[tuple[Track, detect.Find]]) -> bool:
        return any(track.accepts(find, new.stamp_ns) for new, find in fresh)

    @staticmethod
    def _is_taken(find: detect.Find, finds: list[tuple[Track, detect.Find]]) -> bool:
        return any(np.hypot(*(find.centre - other.centre)) < detect.spacing_px(other.corners) for _, other in finds)

    def _is_search_due(self, stamp_ns: int) -> bool:
        if self._next_search_ns is None:
            self._next_search_ns = stamp_ns + self._search_phase_ns
        return bool(self._expected) and stamp_ns >= self._next_search_ns

    def _schedule_search(self, stamp_ns: int) -> None:
        """Search at the full rate while nothing is in view, at half of it while something is missing, else seldom."""
        seen = len(set(self.tracked))
        rate_hz = self._search_rate_hz if not seen else self._search_rate_hz / 2
        if seen == len(self._expected):
            rate_hz = self._settings.tracked_search_rate_hz
        self._next_search_ns = stamp_ns + round(_NS / rate_hz)

    def _measure(self, track: Track, gravity_of: GravityOf) -> Sighting | None:
        """Return the sighting of an identified, expected board, unless its corners fit no pose."""
        expected = self._expected.get(track.code) if track.code is not None else None
        if expected is None:
            self.counts["unknown"] += 1
            return None
        points = self._points[expected.code]
        poses = pose.planar_poses(track.corners, points, self._intrinsics)
        if not poses:
            self.counts["no_pose"] += 1
            return None
        choice = pose.choose(
            poses,
            points,
            self._intrinsics,
            gravity_of(expected.entity),
            self._settings.corner_floor_px,
            self._settings.ambiguity_cost,
        )
        if choice.residual_px > self._settings.max_residual_px:
            self.counts["residual"] += 1
            return None
        return Sighting(expected.entity, track.margin, choice, track.corners)

    def _is_over(self, track: Track, stamp_ns: int) -> bool:
        foreign = track.code is not None and track.code not in self._expected
        return foreign or track.is_lost(stamp_ns)

    def _unique(self, sightings: list[Sighting]) -> list[Sighting]:
        """Return sightings of entities that were seen once; two boards with one code cannot both be right."""
        times = Counter(sighting.entity for sighting in sightings)
        self.counts["double"] += sum(times[s.entity] > 1 for s in sightings)
        return [sighting for sighting in sightings if times[sighting.entity] == 1]
