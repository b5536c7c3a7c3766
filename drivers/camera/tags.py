"""Square tags, the second kind of marker: looked for where they are expected, and seldom in whole pictures."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from drivers.camera import pose
from drivers.camera.detect import Window, resized, window_around
from drivers.camera.dictionaries import family_of
from drivers.camera.prediction import Prediction
from drivers.camera.settings import DetectorSettings, MarkerSettings
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


@dataclass(slots=True)
class _Seen:
    corners: Array
    stamp_ns: int


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
        self._seen: dict[str, _Seen] = {}

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
        """Return the sightings of tags: in their windows, and with `everywhere` in the whole picture."""
        found = self._everywhere(picture) if everywhere else []
        if not everywhere:
            for marker, tag in self._markers:
                window, side = self._window(marker.entity, stamp_ns, predictions, picture.shape)
                if window is not None:
                    finds = self._detect(picture, tag.dictionary, window, side)
                    found += [(marker, corners) for number, corners in finds if number == tag.id]
        for marker, corners in found:
            self._seen[marker.entity] = _Seen(corners, stamp_ns)
        self._seen = {e: seen for e, seen in self._seen.items() if stamp_ns - seen.stamp_ns <= _LIFETIME_NS}
        sightings = (self._measured(marker, corners, gravity_of) for marker, corners in found)
        return [sighting for sighting in sightings if sighting is not None]

    def _window(
        self, entity: str, stamp_ns: int, predictions: Mapping[str, Prediction | None], shape: tuple[int, ...]
    ) -> tuple[Window | None, float]:
        """Return the window to look in, and the approximate side of the tag [px]."""
        seen, prediction = self._seen.get(entity), predictions.get(entity)
        if seen is not None:
            side = _side_px(seen.corners)
            return window_around(seen.corners, 0.8 * side + 12.0, shape), side
        if prediction is not None:
            return prediction.window(shape), prediction.radius_px
        return None, 1.0

    def _everywhere(self, picture: Image) -> list[tuple[MarkerSettings, Array]]:
        wanted = {(tag.dictionary, tag.id): marker for marker, tag in self._markers}
        window = Window(0, 0, picture.shape[1], picture.shape[0])
        return [
            (wanted[name, number], corners)
            for name in self._finders
            for number, corners in self._detect(picture, name, window, _WANTED_PX)
            if (name, number) in wanted
        ]

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
