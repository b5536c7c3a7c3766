"""One camera's detection without I/O: picture, attitudes and belief in, sightings out; keeps tracks in between."""

import time
from collections import Counter, defaultdict
from collections.abc import Callable, Collection, Mapping
from types import MappingProxyType

import numpy as np

from drivers.camera import detect, markers, pose
from drivers.camera.faults import MarkerFaults
from drivers.camera.measuring import DropOf, GravityOf, Measuring, Scene
from drivers.camera.prediction import Prediction, is_looked_for
from drivers.camera.search import find_in, search
from drivers.camera.settings import DetectorSettings, MarkerSettings
from drivers.camera.sighting import Sighting
from drivers.camera.tags import TAG_MARGIN, TagFinder
from drivers.camera.tracks import Track
from drivers.camera.whole_searches import SearchRates, WholeSearches
from groundstation.arrays import Array, Image
from groundstation.bus.notice import Notice
from groundstation.geometry.lens import CameraIntrinsics

Followed = list[tuple[Track, detect.Find]]

# Corners beside a tracked board, including those of its bar, are no new board.
_TAKEN_SQUARES = 2.2
# A bar on the wrong side; clutter may look like one.
_MIRRORED_MARGIN = 2.0
_NOTHING_EXPECTED: Mapping[str, Prediction | None] = MappingProxyType({})


def _unknown_drop(_entity: str) -> float | None:
    return None


class Pipeline:
    """Finds, follows, identifies and measures the expected markers of one camera.

    `counts`: markers found, missed and refused since the start, by name; `searched`: whether the last picture was
    wholly searched; `unmeasured`: the entities without a sighting that it may show all the same, because a find was
    refused, was one of several, or cannot be read.
    cpu_s: returns the CPU time of this thread [s]; others: markers of the field that this camera does not report.
    """

    def __init__(
        self,
        intrinsics: CameraIntrinsics,
        expected: tuple[MarkerSettings, ...],
        settings: DetectorSettings,
        search_rate_hz: float,
        search_phase_s: float = 0.0,
        cpu_s: Callable[[], float] = time.thread_time,
        others: tuple[MarkerSettings, ...] = (),
    ) -> None:
        self._intrinsics = intrinsics
        self._settings = settings
        self._expected = {marker.code: marker for marker in expected if marker.code is not None}
        self._known = {marker.code: marker.entity for marker in (*expected, *others) if marker.code is not None}
        self._markers = {marker.entity: marker for marker in expected}
        self._tags = TagFinder(expected)
        self._searches = WholeSearches(SearchRates.of(settings, search_rate_hz), search_phase_s)
        self._cpu_s = cpu_s
        self._tracks: list[Track] = []
        self.searched = False
        self.unmeasured: tuple[str, ...] = ()
        self._blind: Counter[str] = Counter()
        self._faults = MarkerFaults()
        self.counts: Counter[str] = Counter()
        self._measuring = Measuring(intrinsics, expected, settings, self._faults, self.counts)

    @property
    def tracked(self) -> tuple[str, ...]:
        """Return the entities in view."""
        boards = (entity for track in self._tracks if (entity := self._entity_of(track)) is not None)
        return (*boards, *self._tags.tracked)

    def windows(self, stamp_ns: int, shape: tuple[int, ...]) -> list[detect.Window]:
        """Return the windows in which the boards in view will be looked for, in a picture of that time and shape."""
        found = (track.window(stamp_ns, shape, None) for track in self._tracks)
        return [window for window in found if window is not None]

    def take_notices(self) -> list[Notice]:
        """Return and forget new notices for the operator; none is repeated."""
        return self._faults.take()

    def process(
        self,
        picture: Image,
        stamp_ns: int,
        gravity_of: GravityOf,
        predictions: Mapping[str, Prediction | None] = _NOTHING_EXPECTED,
        drop_of: DropOf = _unknown_drop,
        sought: Collection[str] = (),
    ) -> list[Sighting]:
        """Return the sightings in a picture exposed at `stamp_ns`.

        gravity_of, drop_of: known "down" and depth of a subject; predictions: where the belief expects each marker;
        sought: entities for which whole pictures are searched often.
        """
        finds = self._follow(picture, stamp_ns, predictions)
        self._look_where_expected(picture, stamp_ns, predictions, finds)
        searching = self.searched = self._is_search_due(stamp_ns, sought)
        begun_s = self._cpu_s()
        if searching:
            finds += self._search(picture, stamp_ns) if self._expected else []
        tags = self._tags.look(picture, stamp_ns, predictions, searching)
        if searching:
            for marker in self._tags.mirrored(picture):
                self._mirrored(marker)
            self._schedule_search(stamp_ns, predictions, self._cpu_s() - begun_s)
        scene = Scene(stamp_ns, gravity_of, drop_of)
        shown = {marker.entity for marker, _ in tags}
        found = []
        for marker, corners in tags:
            self._faults.identified(marker.entity)
            found.append(self._measuring.sighting(marker, corners, TAG_MARGIN, scene))
        for track, find in finds:
            rays = self._intrinsics.normalised_from_pixels(find.corners)
            self._identify(picture, track, find, rays, stamp_ns)
            shown |= self._may_be(track)
            found.append(self._measure(track, rays, scene))
        self._forget(stamp_ns, predictions)
        sightings = self._resolved([sighting for sighting in found if sighting is not None], predictions)
        self.unmeasured = tuple(sorted(shown - {sighting.entity for sighting in sightings}))
        return sightings

    def _entity_of(self, track: Track) -> str | None:
        marker = self._expected.get(track.code) if track.code is not None else None
        return marker.entity if marker is not None else None

    def _prediction_of(self, track: Track, predictions: Mapping[str, Prediction | None]) -> Prediction | None:
        """Return where the belief expects a track's board; one that must be read again is expected as before."""
        code = track.code if track.code is not None else track.pending
        marker = self._expected.get(code) if code is not None else None
        return predictions.get(marker.entity) if marker is not None else None

    def _follow(self, picture: Image, stamp_ns: int, predictions: Mapping[str, Prediction | None]) -> Followed:
        finds: Followed = []
        for track in self._tracks:
            prediction = self._prediction_of(track, predictions)
            find = self._followed(track, picture, stamp_ns, prediction)
            if find is None or not track.accepts(find, stamp_ns, prediction) or _is_taken(find, finds):
                track.miss()
                self.counts["missed"] += 1
                continue
            track.follow(find, stamp_ns, prediction)
            self.counts["followed"] += 1
            finds.append((track, find))
        return finds

    def _followed(
        self, track: Track, picture: Image, stamp_ns: int, prediction: Prediction | None
    ) -> detect.Find | None:
        """Return the board of a track: where its corners are expected, else anywhere in the window around them."""
        find = detect.follow_board(picture, track.expected_corners(stamp_ns, prediction))
        window = None if find else track.window(stamp_ns, picture.shape, prediction)
        return detect.find_board(picture, window, detect.spacing_px(track.corners)) if window else find

    def _look_where_expected(
        self, picture: Image, stamp_ns: int, predictions: Mapping[str, Prediction | None], finds: Followed
    ) -> None:
        """Look for missing markers where the belief expects them; adds to `finds`."""
        followed = {self._entity_of(track) for track, _ in finds}
        boards = {marker.entity for marker in self._expected.values()}
        for entity, prediction in predictions.items():
            if prediction is None or entity not in boards or entity in followed or _is_there(prediction, finds):
                self._blind[entity] = 0
                continue
            self._blind[entity] += 1
            window = prediction.window(picture.shape) if is_looked_for(self._blind[entity]) else None
            if window is None:
                continue
            find = find_in(picture, window, prediction.spacing_px, [other.corners for _, other in finds])
            if find is None or _is_taken(find, finds):
                self.counts["absent"] += 1
                continue
            self.counts["foreseen"] += 1
            finds.append((self._adopted(find, stamp_ns, predictions), find))

    def _adopted(self, find: detect.Find, stamp_ns: int, predictions: Mapping[str, Prediction | None]) -> Track:
        """Return the track that lost this board, else a new one; its bar identifies it later.

        It may belong to another entity than the expected one: then that entity's prediction counts.
        """
        for track in self._tracks:
            own = self._prediction_of(track, predictions)
            if track.misses and track.accepts(find, stamp_ns, own):
                track.follow(find, stamp_ns, own)
                return track
        self._tracks.append(Track(find.corners, stamp_ns))
        return self._tracks[-1]

    def _search(self, picture: Image, stamp_ns: int) -> Followed:
        taken = []
        for track in self._tracks:
            if track.misses == 0:
                margin_px = _TAKEN_SQUARES * detect.spacing_px(track.corners)
                window = detect.window_around(track.corners, margin_px, picture.shape)
                taken += [window] if window else []
        known = [(track, detect.Find(track.corners, 0.0, 0.0)) for track in self._tracks if track.misses == 0]
        finds = [find for find in search(picture, taken) if not _is_taken(find, known)]
        fresh = [(Track(find.corners, stamp_ns), find) for find in finds]
        # A board that is found again replaces the track that missed it.
        self._tracks = [t for t in self._tracks if t.misses == 0 or not _is_taken_by(t, fresh)]
        self._tracks += [track for track, _ in fresh]
        self.counts["searches"] += 1
        self.counts["found"] += len(fresh)
        return fresh

    def _is_search_due(self, stamp_ns: int, sought: Collection[str]) -> bool:
        if not self._markers:
            return False
        seen = set(self.tracked)
        return self._searches.is_due(stamp_ns, bool(seen), bool(set(sought) & set(self._markers) - seen))

    def _schedule_search(self, stamp_ns: int, predictions: Mapping[str, Prediction | None], cost_s: float) -> None:
        """Plan the next search by the missing markers; those that the belief has elsewhere are not missing."""
        missing = {entity for entity in self._markers if predictions.get(entity, ...) is not None} - set(self.tracked)
        self._searches.done(stamp_ns, bool(missing), cost_s)

    def _forget(self, stamp_ns: int, predictions: Mapping[str, Prediction | None]) -> None:
        """Drop tracks that have ended; if a marker was lost that should still be in view, search soon."""
        over = [track for track in self._tracks if self._is_over(track, stamp_ns)]
        self._tracks = [track for track in self._tracks if not self._is_over(track, stamp_ns)]
        lost = [entity for track in over if (entity := self._entity_of(track)) is not None]
        if any(predictions.get(entity, ...) is not None for entity in lost):
            self._searches.lost(stamp_ns)

    def _is_over(self, track: Track, stamp_ns: int) -> bool:
        foreign = track.code is not None and track.code not in self._expected
        return foreign or track.is_lost(stamp_ns)

    def _identify(self, picture: Image, track: Track, find: detect.Find, rays: Array, stamp_ns: int) -> None:
        least = self._settings.identity_margin
        reading = markers.read_bar(picture, find, self._intrinsics, rays=rays)
        track.identify(reading, stamp_ns, least)
        if track.code in self._known:
            self._faults.identified(self._known[track.code])
        elif track.code is not None:
            self._faults.foreign(track.code, stamp_ns, self._markers.values())
        if track.code is not None or (reading is not None and reading.is_sure(least)):
            return
        mirrored = markers.read_bar(picture, find, self._intrinsics, mirrored=True, rays=rays)
        marker = self._expected.get(mirrored.code) if mirrored is not None else None
        if marker is not None and mirrored is not None and mirrored.is_sure(max(least, _MIRRORED_MARGIN)):
            self._mirrored(marker)

    def _mirrored(self, marker: MarkerSettings) -> None:
        self.counts["mirrored"] += 1
        self._faults.mirrored(marker)

    def _may_be(self, track: Track) -> set[str]:
        """Return the entities whose board a track may be: an unread one may be that of each."""
        entity = self._entity_of(track)
        if entity is not None:
            return {entity}
        return {marker.entity for marker in self._expected.values()} if track.code is None else set()

    def _measure(self, track: Track, rays: Array, scene: Scene) -> Sighting | None:
        """Return the sighting of an identified, expected board, unless its corners (and their rays) fit no pose."""
        expected = self._expected.get(track.code) if track.code is not None else None
        if expected is None:
            self.counts["unknown"] += 1
            return None
        return self._measuring.sighting(expected, track.corners, track.margin, scene, rays)

    def _resolved(self, sightings: list[Sighting], predictions: Mapping[str, Prediction | None]) -> list[Sighting]:
        """Return one sighting per entity; a second board with the same code becomes an alternative.

        The one nearer to the estimated place comes first, and the estimator decides. Without an estimate they cannot
        be distinguished, and both are withheld; so are three.
        """
        by_entity: defaultdict[str, list[Sighting]] = defaultdict(list)
        for sighting in sightings:
            by_entity[sighting.entity].append(sighting)
        resolved = []
        for entity, group in by_entity.items():
            if len(group) == 1:
                resolved += group
                continue
            self.counts["double"] += len(group)
            self._faults.doubled(self._markers[entity])
            prediction = predictions.get(entity)
            if prediction is None or len(group) > 2:
                continue
            centre = prediction.centre
            first, other = sorted(group, key=lambda s: float(np.hypot(*(s.corners.mean(axis=0) - centre))))
            choice = pose.PoseChoice(first.choice.best, other.choice.best, first.choice.residual_px)
            resolved.append(Sighting(entity, min(first.margin, other.margin), choice, first.corners))
        return resolved


def _is_there(prediction: Prediction, finds: Followed) -> bool:
    """Return whether a board without a readable bar already stands where this marker is expected."""
    return any(track.code is None and prediction.is_at(find.centre) for track, find in finds)


def _is_taken_by(track: Track, fresh: Followed) -> bool:
    return any(track.accepts(find, new.stamp_ns) for new, find in fresh)


def _is_taken(find: detect.Find, finds: Followed) -> bool:
    return any(np.hypot(*(find.centre - other.centre)) < detect.spacing_px(other.corners) for _, other in finds)
