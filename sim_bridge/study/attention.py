"""The camera driver's own rules for searching a picture: all of it, or the places of expected markers."""

from collections import Counter
from collections.abc import Collection, Sequence

from drivers.camera.prediction import Attitude, Foresight, Predictions, is_looked_for
from drivers.camera.settings import (
    SEARCH_RATE_HZ,
    DetectorSettings,
    MarkerKind,
    MarkerSettings,
    MountSettings,
    TagSettings,
)
from drivers.camera.whole_searches import SearchRates, WholeSearches
from groundstation.bus.messages import Estimate
from groundstation.geometry.board import Checkerboard
from groundstation.geometry.lens import CameraIntrinsics
from groundstation.geometry.tag import SquareTag
from sim_bridge.site import Site, SiteCamera, SiteDrone

# Median cost of a search [s of CPU], without tags (docs/reference/vision.md 8): there is no picture to measure.
_COST_S = 0.01


def mount_of(name: str, mount: SiteDrone | SiteCamera) -> MountSettings:
    """Return a camera's mounting as in its driver's settings; name: the drone that carries it."""
    if isinstance(mount, SiteCamera):
        return MountSettings(position_m=mount.position_m, looking="down", rotation_deg=mount.rotation_deg)
    assert mount.camera is not None
    camera = mount.camera
    return MountSettings(
        parent=name, position_m=camera.position_m, tilt_down_deg=camera.tilt_down_deg, pan_deg=camera.pan_left_deg
    )


def marker_of(
    entity: str, printed: Checkerboard | SquareTag, position_m: tuple[float, float, float], robots: Collection[str]
) -> MarkerSettings:
    """Return a marker as in a driver's settings."""
    kind = MarkerKind.ROBOT if entity in robots else MarkerKind.TARGET
    if isinstance(printed, SquareTag):
        tag = TagSettings(dictionary=printed.dictionary, id=printed.id, size_mm=printed.size_mm)
        return MarkerSettings(entity=entity, kind=kind, position_m=position_m, tag=tag)
    square_mm = 1000.0 * printed.square_m
    return MarkerSettings(entity=entity, kind=kind, position_m=position_m, code=printed.code, square_mm=square_mm)


def phase_s(name: str, site: Site) -> float:
    """Return the delay of a camera's searches after the first camera's [s], as in the drivers' settings."""
    cameras = (*site.cameras, *site.drones)
    return cameras.index(name) / (len(cameras) * SEARCH_RATE_HZ)


class Attention:
    """The searches of one camera's driver. Use: `hear` estimates; for each picture `begin`, then `end`.

    searching: whether the picture is searched all over.
    """

    def __init__(
        self, mount: MountSettings, observer: str, markers: Sequence[MarkerSettings], lens: CameraIntrinsics,
        phase_s: float,
    ) -> None:  # fmt: skip
        self._foresight = Foresight(mount, observer, tuple(markers), lens)
        self._searches = WholeSearches(SearchRates.of(DetectorSettings(), SEARCH_RATE_HZ), phase_s)
        self._names = frozenset(marker.entity for marker in markers)
        self._predictions: Predictions = {}
        self._tracked: frozenset[str] = frozenset()
        self._missing: Counter[str] = Counter()
        self._stamp_ns = 0
        self.searching = False

    def take(self, estimate: Estimate) -> None:
        """Take an estimate of the tracker."""
        self._foresight.add(estimate)

    def begin(self, stamp_ns: int, attitude: Attitude, tracked: Collection[str]) -> None:
        """Begin a picture; attitude: the carrier's measured one; tracked: entities that the last pictures showed."""
        tracked = self._names.intersection(tracked)
        lost, self._tracked, self._stamp_ns = self._tracked - tracked, tracked, stamp_ns
        unseen = self._names - tracked
        self._predictions = self._foresight.at(stamp_ns, attitude) if unseen else {}
        if any(self._predictions.get(name, ...) is not None for name in lost):
            self._searches.lost(stamp_ns)
        for name in self._names:
            expected = name in unseen and self._predictions.get(name) is not None
            self._missing[name] = self._missing[name] + 1 if expected else 0
        sought = bool(unseen and unseen & self._foresight.sought(stamp_ns, self._predictions))
        self.searching = bool(self._names) and self._searches.is_due(stamp_ns, bool(tracked), sought)

    def expects(self, name: str, pixel: tuple[float, float] | None) -> bool:
        """Return whether a marker that is not tracked is searched for at its true place [px]: the belief is near it."""
        prediction = self._predictions.get(name)
        if prediction is None or pixel is None or not is_looked_for(self._missing[name]):
            return False
        off_px = float(((prediction.centre - pixel) ** 2).sum() ** 0.5)
        return off_px + prediction.radius_px <= prediction.reach_px

    def end(self, found: Collection[str]) -> None:
        """End a picture; found: the entities that it showed."""
        if not self.searching:
            return
        missing = {name for name in self._names if self._predictions.get(name, ...) is not None}
        self._searches.done(self._stamp_ns, bool(missing - self._tracked.union(found)), _COST_S)
