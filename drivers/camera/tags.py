"""Square tags, the second kind of marker: looked for where they are expected, and seldom in whole pictures."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from drivers.camera.detect import Window, resized, window_around
from drivers.camera.dictionaries import family_of
from drivers.camera.prediction import Prediction
from drivers.camera.settings import MarkerSettings, TagSettings
from groundstation.arrays import Array, Image
from groundstation.time_units import NS_PER_MS

TAG_MARGIN = 2.0
"""Margin of a tag's identity: it is read as a whole, with the parity of its dictionary, so no reading is half-sure."""
_LIFETIME_NS = 450 * NS_PER_MS
# A tag's side in a window: smaller ones are enlarged to this, because their bits need three pixels each.
_WANTED_PX, _MOST_ENLARGEMENT = 48.0, 4.0
# In each so many searches the picture is searched as in a mirror, too.
_MIRROR_STRIDE = 3


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
    """Finds the expected tags of one camera."""

    def __init__(self, markers: tuple[MarkerSettings, ...]) -> None:
        self._markers = [(marker, marker.tag) for marker in markers if marker.tag is not None]
        names = {tag.dictionary for _, tag in self._markers}
        self._finders = {name: family_of(name).finder() for name in sorted(names)}
        # Each entity's places: a spare print of its tag has one too.
        self._seen: dict[str, list[_Seen]] = {}
        # Tags of the last picture that was searched all over, by dictionary, and entities whose tags were ever read.
        self._read: dict[str, list[tuple[int, Array]]] = {}
        self._sound: set[str] = set()
        self._in_vain = 0

    @property
    def tracked(self) -> tuple[str, ...]:
        """Return the entities in view."""
        return tuple(self._seen)

    def look(
        self, picture: Image, stamp_ns: int, predictions: Mapping[str, Prediction | None], everywhere: bool
    ) -> list[tuple[MarkerSettings, Array]]:
        """Return the tags in a picture, with their corners (4, 2) [px]; several prints of one are all there.

        They are looked for in their windows, and with `everywhere` in the whole picture.
        """
        whole = self._everywhere(picture) if everywhere else {}
        places, finds = {}, []
        for marker, tag in self._markers:
            seen, known = self._seen.get(marker.entity, []), whole.get(marker.entity, [])
            found = self._found(picture, tag, seen, predictions.get(marker.entity), known)
            recent = [place for place in seen if stamp_ns - place.stamp_ns <= _LIFETIME_NS]
            places[marker.entity] = [_Seen(corners, stamp_ns) for corners in found] + _vacant(recent, found)
            finds += [(marker, corners) for corners in found]
        self._seen = {entity: those for entity, those in places.items() if those}
        self._sound |= {marker.entity for marker, _ in finds}
        return finds

    def mirrored(self, picture: Image) -> list[MarkerSettings]:
        """Return tags that a picture, just looked at everywhere, shows only in its mirror image.

        Looked for now and then, and only those that were never seen as printed.
        """
        missing = [(marker, tag) for marker, tag in self._markers if marker.entity not in self._sound]
        self._in_vain += bool(missing)
        if not missing or self._in_vain % _MIRROR_STRIDE:
            return []
        turned, whole = np.ascontiguousarray(picture[:, ::-1]), _whole(picture)
        found = []
        for name in sorted({tag.dictionary for _, tag in missing}):
            # What reads both ways is another tag whose mirror image happens to be a word too.
            straight = [_mirrored(corners, picture) for _, corners in self._read[name]]
            reads = self._detect(turned, name, whole, _WANTED_PX)
            numbers = {number for number, corners in reads if not any(_is_same(corners, other) for other in straight)}
            found += [marker for marker, tag in missing if tag.dictionary == name and tag.id in numbers]
        return found

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
        """Return the corners of a tag's prints in a window; side: their approximate size [px].

        The finder takes its threshold in squares of fixed sizes, so some prints are found in their own size only.
        """
        if window is None:
            return []
        for size in (side, _WANTED_PX) if side < _WANTED_PX else (side,):
            finds = self._detect(picture, tag.dictionary, window, size)
            if found := [corners for number, corners in finds if number == tag.id]:
                return found
        return []

    def _everywhere(self, picture: Image) -> dict[str, list[Array]]:
        """Return the corners of all expected tags in the whole picture, by entity."""
        self._read = {name: self._detect(picture, name, _whole(picture), _WANTED_PX) for name in self._finders}
        return {
            marker.entity: [corners for number, corners in self._read[tag.dictionary] if number == tag.id]
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


def _whole(picture: Image) -> Window:
    return Window(0, 0, picture.shape[1], picture.shape[0])


def _mirrored(corners: Array, picture: Image) -> Array:
    """Return corners (4, 2) [px] in the mirror image of a picture."""
    return np.column_stack((picture.shape[1] - 1.0 - corners[:, 0], corners[:, 1]))


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
