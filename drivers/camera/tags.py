"""The second kind of marker: ArUco and AprilTag tags, found by OpenCV where they are expected, else seldom anywhere."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import cv2
import numpy as np

from drivers.camera import pose
from drivers.camera.detect import Window, resized, window_around
from drivers.camera.dictionaries import dictionary_of
from drivers.camera.prediction import Prediction
from drivers.camera.settings import DetectorSettings, MarkerSettings
from drivers.camera.sighting import Sighting
from groundstation.arrays import Array, Image
from groundstation.geometry.lens import CameraIntrinsics

GravityOf = Callable[[str], pose.Gravity]

_LIFETIME_NS = 450_000_000
# A tag's side in a window: smaller ones are enlarged to this, for their bits need three pixels each.
_WANTED_PX, _MOST_ENLARGEMENT = 48.0, 4.0
# Measured: the corners of tags scatter ten times as much as those of checkerboards, and four of them leave only two
# degrees of freedom to notice it.
_CORNER_STD_PX = 0.6
# A tag is read as a whole, with the parity of its dictionary: there are no half-sure readings.
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
        self._detectors = {name: _detector(name) for name in sorted(names)}
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
        """Return where to look, and about how long a side will be [px]."""
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
            for name in self._detectors
            for number, corners in self._detect(picture, name, window, _WANTED_PX)
            if (name, number) in wanted
        ]

    def _detect(self, picture: Image, name: str, window: Window, side: float) -> list[tuple[int, Array]]:
        """Return ids and corners (4, 2) [px] of the tags in a window."""
        part = picture[window.top : window.bottom, window.left : window.right]
        enlarged, ratio = resized(part, float(np.clip(_WANTED_PX / max(side, 1.0), 1.0, _MOST_ENLARGEMENT)))
        corners, ids, _ = self._detectors[name].detectMarkers(np.ascontiguousarray(enlarged))
        if not len(corners):
            return []
        place = np.array([window.left, window.top])
        return [
            (int(number), (np.asarray(four, np.float64).reshape(4, 2) + 0.5) * ratio - 0.5 + place)
            for four, number in zip(corners, np.ravel(ids), strict=True)
        ]

    def _measured(self, marker: MarkerSettings, corners: Array, gravity_of: GravityOf) -> Sighting | None:
        points = self._points[marker.entity]
        poses = pose.planar_poses(corners, points, self._intrinsics)
        if not poses:
            return None
        floor_px = max(_CORNER_STD_PX, self._settings.corner_floor_px)
        choice = pose.choose(
            poses, points, self._intrinsics, gravity_of(marker.entity), floor_px, self._settings.ambiguity_cost
        )
        if choice.residual_px > self._settings.max_residual_px:
            return None
        return Sighting(marker.entity, _MARGIN, choice, corners)


def _detector(name: str) -> cv2.aruco.ArucoDetector:
    parameters = cv2.aruco.DetectorParameters()
    parameters.cornerRefinementMethod = cv2.aruco.CORNER_REFINE_SUBPIX
    return cv2.aruco.ArucoDetector(dictionary_of(name), parameters)


def _side_px(corners: Array) -> float:
    return float(np.hypot(*(np.roll(corners, 1, axis=0) - corners).T).min())
