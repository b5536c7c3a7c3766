"""Square tags, the second kind of marker: looked for where they are expected, and seldom in whole pictures."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from drivers.camera import pose
from drivers.camera.detect import Window, resized, window_around
from drivers.camera.dictionaries import family_of
from drivers.camera.prediction import Prediction
from drivers.camera.settings import DetectorSettings, MarkerSettings, TagSettings
from drivers.camera.sighting import Sighting
from groundstation.arrays import Array, Image
from groundstation.geometry.lens import CameraIntrinsics
from groundstation.time_units import NS_PER_MS

GravityOf = Callable[[str], pose.Gravity]

_LIFETIME_NS = 450 * NS_PER_MS
# A tag's side in a window: smaller ones are enlarged to this, because their bits need three pixels each.
_WANTED_PX, _MOST_ENLARGEMENT = 48.0, 4.0
# A tag is read as a whole, with the parity of its dictionary: no reading is half-sure.
_MARGIN = 2.0


@dataclass(frozen=True, slots=True, eq=False)
class _Seen:
    """A tag in an earlier picture: its corners (4, 2) [px], and when it was exposed."""

    corners: Array
    stamp_ns: int

    def window(self, shape: tuple[int, ...]) -> Window | None:
        """Return the window in which it will be again, or None when that is outside of the picture."""
        return window_around(self.corners, self._reach_px, shape)

    def may_be(self, corners: Array) -> bool:
        """Return whether its tag may have moved to these corners since."""
        return _distance_px(self.corners, corners) < self._reach_px

    @property
    def _reach_px(self) -> float:
        return 0.8 * _side_px(self.corners) + 12.0


class TagFinder:
    """Finds and measures the expected tags of one camera."""

    def __init__(
        self, intrinsics: CameraIntrinsics, markers: tuple[MarkerSettings, ...], settings: DetectorSettings
    ) -> None:
        self._intrinsics, self._settings = intrinsics, settings
        self._markers = [(marker, marker.tag) for marker in markers if marker.tag is not None]
        self._points = {marker.entity: marker.printed.corners() for marker, _ in self._markers}
        names = {tag.dictionary for _, tag in self._markers}
        self._families = {name: family_of(name) for name in sorted(names)}
        self._finders = {name: family.finder() for name, family in self._families.items()}
        # Each entity's places: a spare print of its tag has one too.
        self._seen: dict[str, list[_Seen]] = {}

    @property
    def tracked(self) -> tuple[str, ...]:
        """Return the entities in view."""
        return tuple(self._seen)

    def look(
        self,
        picture: Image,
        stamp_ns: int,
        gravity_of: GravityOf,
        predictions: Mapping[str, Prediction | None],
        everywhere: bool,
    ) -> list[Sighting]:
        """Return the sightings of tags: in their windows, and with `everywhere` in the whole picture.

        Several prints with one identity give several sightings of their entity.
        """
        whole = self._everywhere(picture) if everywhere else {}
        sightings, places = [], {}
        for marker, tag in self._markers:
            seen, known = self._seen.get(marker.entity, []), whole.get(marker.entity, [])
            found = self._found(picture, tag, seen, predictions.get(marker.entity), known)
            recent = [place for place in seen if stamp_ns - place.stamp_ns <= _LIFETIME_NS]
            places[marker.entity] = [_Seen(corners, stamp_ns) for corners in found] + _vacant(recent, found)
            sightings += [self._measured(marker, corners, gravity_of) for corners in found]
        self._seen = {entity: those for entity, those in places.items() if those}
        return [sighting for sighting in sightings if sighting is not None]

    def _found(
        self, picture: Image, tag: TagSettings, places: list[_Seen], prediction: Prediction | None, known: list[Array]
    ) -> list[Array]:
        """Return the corners of all prints of a tag: those known from a search, in their places, where expected."""
        found = _each_once(known)
        for seen in places:
            if not any(_is_same(seen.corners, corners) for corners in found):
                finds = self._prints(picture, tag, seen.window(picture.shape), _side_px(seen.corners))
                found = _each_once(found + finds)
        if prediction is None or any(prediction.is_at(corners.mean(axis=0)) for corners in found):
            return found
        return _each_once(found + self._prints(picture, tag, prediction.window(picture.shape), prediction.radius_px))

    def _prints(self, picture: Image, tag: TagSettings, window: Window | None, side: float) -> list[Array]:
        """Return the corners of a tag's prints in a window; side: their approximate size [px]."""
        finds = self._detect(picture, tag.dictionary, window, side) if window is not None else []
        return [corners for number, corners in finds if number == tag.id]

    def _everywhere(self, picture: Image) -> dict[str, list[Array]]:
        """Return the corners of all expected tags in the whole picture, by entity."""
        window = Window(0, 0, picture.shape[1], picture.shape[0])
        finds = {name: self._detect(picture, name, window, _WANTED_PX) for name in self._finders}
        return {
            marker.entity: [corners for number, corners in finds[tag.dictionary] if number == tag.id]
            for marker, tag in self._markers
        }

    def _detect(self, picture: Image, name: str, window: Window, side: float) -> list[tuple[int, Array]]:
        """Return ids and corners (4, 2) [px] of the tags in a window."""
        part = picture[window.top : window.bottom, window.left : window.right]
        enlarged, ratio = resized(part, float(np.clip(_WANTED_PX / max(side, 1.0), 1.0, _MOST_ENLARGEMENT)))
        place = np.array([window.left, window.top])
        try:
            finds = [(int(number), np.asarray(four, np.float64)) for number, four in self._finders[name](enlarged)]
        except Exception as error:  # a detector may be any plug-in: the picture is counted as failed
            raise ValueError(f"tags {name}: {type(error).__name__}: {error}") from error
        return [(number, (four + 0.5) * ratio - 0.5 + place) for number, four in finds if four.shape == (4, 2)]

    def _measured(self, marker: MarkerSettings, corners: Array, gravity_of: GravityOf) -> Sighting | None:
        points = self._points[marker.entity]
        poses = pose.planar_poses(corners, points, self._intrinsics)
        if not poses:
            return None
        assert marker.tag is not None
        floor_px = max(self._families[marker.tag.dictionary].corner_std_px, self._settings.corner_floor_px)
        choice = pose.choose(
            poses, points, self._intrinsics, gravity_of(marker.entity), floor_px, self._settings.ambiguity_cost
        )
        if choice.residual_px > self._settings.max_residual_px:
            return None
        return Sighting(marker.entity, _MARGIN, choice, corners)


def _side_px(corners: Array) -> float:
    return float(np.hypot(*(np.roll(corners, 1, axis=0) - corners).T).min())


def _distance_px(one: Array, other: Array) -> float:
    return float(np.hypot(*(one.mean(axis=0) - other.mean(axis=0))))


def _is_same(one: Array, other: Array) -> bool:
    """Return whether two finds are one print: their centres are nearer than half a side."""
    return _distance_px(one, other) < 0.5 * _side_px(other)


def _each_once(finds: list[Array]) -> list[Array]:
    """Return finds without those that repeat an earlier one: windows may overlap."""
    return [one for k, one in enumerate(finds) if not any(_is_same(one, other) for other in finds[:k])]


def _vacant(places: list[_Seen], found: list[Array]) -> list[_Seen]:
    """Return the places whose tags are not found: each find is that of the nearest place which it may be from."""
    vacant = list(places)
    for corners in found:
        origins = [place for place in vacant if place.may_be(corners)]
        if origins:
            vacant.remove(min(origins, key=lambda place: _distance_px(place.corners, corners)))
    return vacant
