"""Preview of the detector's results on a camera's pictures: text and annotated pictures."""

import math
import time
from dataclasses import dataclass

import numpy as np

from drivers.camera.calibration import annotate
from drivers.camera.calibration.feed import SourcePicture
from drivers.camera.pipeline import Pipeline
from drivers.camera.pose import Gravity, PlanarPose, planar_poses
from drivers.camera.settings import DetectorSettings, MarkerSettings
from groundstation.arrays import Array, Image
from groundstation.geometry import board as marker
from groundstation.geometry.lens import CameraIntrinsics
from groundstation.time_units import NS_PER_S

_SEARCH_RATE_HZ = 2.0
# This camera's mounting is unknown: an assumed "down" must not choose between poses here.
_NOWHERE = Gravity(np.eye(3), 0.0, 0.0, known=False)


@dataclass(frozen=True, slots=True)
class Marked:
    """A marker in a picture: code, margin, corners (12, 2) [px], pose by residual alone, its rms [px]."""

    code: int
    margin: float
    corners: Array
    pose: PlanarPose | None
    residual_px: float

    @property
    def range_m(self) -> float:
        """Return its distance [m]; NaN without a pose."""
        return float(np.linalg.norm(self.pose.translation)) if self.pose is not None else math.nan


@dataclass(frozen=True, slots=True)
class Look:
    """Results for one picture: markers, CPU time [ms], and the picture with all results drawn in."""

    shot: SourcePicture
    marked: tuple[Marked, ...]
    unread: int
    cpu_ms: float
    picture: Image

    @property
    def text(self) -> str:
        """Return it in a line."""
        found = [f"marker {m.code} {_range(m)} ({m.residual_px:.2f} px, margin {m.margin:.1f})" for m in self.marked]
        found += [f"{self.unread} that cannot be read"] * bool(self.unread)
        return f"{self.shot.name}: {', '.join(found) or 'nothing found'}; {self.cpu_ms:.1f} ms, {_age(self.shot)}"


class DetectorPreview:
    """Runs the detector over pictures with every code expected.

    lens: None for a camera that is not calibrated: markers are found, but have no distance.
    """

    def __init__(self, size: tuple[int, int], lens: CameraIntrinsics | None, square_mm: float) -> None:
        width, height = size
        guess = CameraIntrinsics(width, height, width, width, (width - 1) / 2, (height - 1) / 2)
        self._lens, self._known = lens or guess, lens is not None
        self._square_m = square_mm / 1000.0
        self._points = marker.Checkerboard(0, square_mm).corners()
        expected = [MarkerSettings(entity=f"m{code}", code=code, square_mm=square_mm) for code in marker.VALID_CODES]
        # A lens that is only guessed leaves residuals that are not the board's fault.
        settings = DetectorSettings() if lens is not None else DetectorSettings(max_residual_px=20.0)
        self._pipeline = Pipeline(self._lens, tuple(expected), settings, _SEARCH_RATE_HZ)

    def look(self, shot: SourcePicture) -> Look:
        """Return the results for a picture."""
        stamp_ns = round(shot.at_s * NS_PER_S)
        windows = self._pipeline.windows(stamp_ns, shot.grey.shape)
        began_s = time.process_time()
        unread = self._pipeline.counts["unknown"]
        sightings = self._pipeline.process(shot.grey, stamp_ns, lambda _entity: _NOWHERE)
        cpu_ms = (time.process_time() - began_s) * 1e3
        unread = self._pipeline.counts["unknown"] - unread
        marked = tuple(self._marked(int(s.entity[1:]), s.margin, s.corners) for s in sightings)
        drawn = annotate.canvas(shot.grey)
        for window in windows:
            corners = np.array([[window.left, window.top], [window.right, window.top],
                                [window.right, window.bottom], [window.left, window.bottom]])  # fmt: skip
            annotate.outline(drawn, corners, annotate.NOTE)
        for one in marked:
            self._draw(drawn, one)
        look = Look(shot, marked, unread, cpu_ms, drawn)
        annotate.lines(drawn, [look.text.split(": ", 1)[0], f"{cpu_ms:.1f} ms, {_age(shot)}"])
        if not self._known:
            annotate.lines(drawn, ["", "", "no calibration: no distances"], annotate.BAD)
        return look

    def _marked(self, code: int, margin: float, corners: Array) -> Marked:
        poses = planar_poses(corners, self._points, self._lens) if self._known else []
        best = min(poses, key=lambda pose: pose.squared_error, default=None)
        residual = math.sqrt(best.squared_error / (2 * len(corners) - 6)) if best is not None else math.nan
        return Marked(code, margin, corners, best, residual)

    def _draw(self, drawn: Image, one: Marked) -> None:
        annotate.dots(drawn, one.corners, annotate.GOOD)
        if one.pose is not None:
            annotate.axes(drawn, one.pose.rotation, one.pose.translation, 2 * self._square_m, self._lens)
        text = f"{one.code}  {_range(one)}" + (f"  {one.residual_px:.2f} px" if one.pose is not None else "")
        annotate.label(drawn, text, one.corners.max(axis=0), annotate.GOOD)


def _range(one: Marked) -> str:
    return f"at {one.range_m:.2f} m" if one.pose is not None else "somewhere"


def _age(shot: SourcePicture) -> str:
    return f"{shot.age_ms:.0f} ms after it came"
