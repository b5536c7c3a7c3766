"""From the corners of an identified marker to its sighting: pose, refusal of corners that fit none, and its size."""

from collections import Counter
from collections.abc import Callable, Iterable
from dataclasses import dataclass

from drivers.camera import pose
from drivers.camera.dictionaries import family_of
from drivers.camera.faults import MarkerFaults
from drivers.camera.settings import DetectorSettings, MarkerSettings
from drivers.camera.sighting import Sighting
from groundstation.arrays import Array
from groundstation.geometry.lens import CameraIntrinsics

GravityOf = Callable[[str], pose.Gravity]
DropOf = Callable[[str], float | None]


@dataclass(frozen=True, slots=True)
class Scene:
    """A picture's exposure [ns], with the known "down" and depth of each subject then."""

    stamp_ns: int
    gravity_of: GravityOf
    drop_of: DropOf


class Measuring:
    """Measures the markers of one camera; `counts` gets the refusals, by name."""

    def __init__(
        self,
        intrinsics: CameraIntrinsics,
        markers: Iterable[MarkerSettings],
        settings: DetectorSettings,
        faults: MarkerFaults,
        counts: Counter[str],
    ) -> None:
        self._intrinsics, self._settings, self._faults, self._counts = intrinsics, settings, faults, counts
        self._points, self._floors_px = {}, {}
        for marker in markers:
            least_px = family_of(marker.tag.dictionary).corner_std_px if marker.tag is not None else 0.0
            self._points[marker.entity] = marker.printed.corners()
            self._floors_px[marker.entity] = max(least_px, settings.corner_floor_px)

    def sighting(
        self, marker: MarkerSettings, corners: Array, margin: float, scene: Scene, rays: Array | None = None
    ) -> Sighting | None:
        """Return the sighting of a marker by its corners (n, 2) [px], unless they fit no pose.

        margin: of its identity; rays: of the corners, normalised (n, 2), if the caller has them.
        """
        points, settings = self._points[marker.entity], self._settings
        poses = pose.planar_poses(corners, points, self._intrinsics, rays)
        if not poses:
            self._counts["no_pose"] += 1
            return None
        gravity, floor_px = scene.gravity_of(marker.entity), self._floors_px[marker.entity]
        choice = pose.choose(poses, points, self._intrinsics, gravity, floor_px, settings.ambiguity_cost)
        if choice.residual_px > settings.max_residual_px:
            self._counts["residual"] += 1
            return None
        relative_m = gravity.stabilized_from_optical @ choice.best.position_m
        self._faults.measured(marker, scene.stamp_ns, relative_m, scene.drop_of(marker.entity))
        return Sighting(marker.entity, margin, choice, corners)
