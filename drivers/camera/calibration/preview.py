"""Preview of the detector's results on a camera's pictures: text and annotated pictures."""

import math
import time
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from drivers.camera.calibration import annotate
from drivers.camera.calibration.feed import SourcePicture
from drivers.camera.dictionaries import family_of
from drivers.camera.pipeline import Pipeline
from drivers.camera.pose import Gravity, PlanarPose, planar_poses
from drivers.camera.settings import DetectorSettings, MarkerSettings, TagSettings
from groundstation.arrays import Array, Image
from groundstation.geometry import board as marker
from groundstation.geometry.lens import CameraIntrinsics
from groundstation.time_units import NS_PER_S

_SEARCH_RATE_HZ = 2.0
# More often than pictures of a folder follow each other.
_EACH_PICTURE_HZ = 1000.0
# This camera's mounting is unknown: an assumed "down" must not choose between poses here.
_NOWHERE = Gravity(np.eye(3), 0.0, 0.0, known=False)


@dataclass(frozen=True, slots=True)
class Marked:
    """A marker in a picture: its print, margin, corners (n, 2) [px], pose by residual alone, its rms [px]."""

    printed: MarkerSettings
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
    """Results for one picture: markers, CPU time [ms], and the picture with all results drawn in.

    unread: boards without a readable bar; mirrored: those of them, and tags, that read in a mirror.
    """

    shot: SourcePicture
    marked: tuple[Marked, ...]
    unread: int
    mirrored: int
    cpu_ms: float
    picture: Image

    @property
    def text(self) -> str:
        """Return it in a line."""
        found = [f"{m.printed.label} {_range(m)} ({m.residual_px:.2f} px, margin {m.margin:.1f})" for m in self.marked]
        found += [f"{self.unread} that cannot be read"] * bool(self.unread)
        found += [f"{self.mirrored} mirrored: the camera's flip, or the print?"] * bool(self.mirrored)
        return f"{self.shot.name}: {', '.join(found) or 'nothing found'}; {self.cpu_ms:.1f} ms, {_age(self.shot)}"


class DetectorPreview:
    """Runs the detector over pictures with every code expected, and every tag of the dictionaries.

    lens: None for a camera that is not calibrated: markers are found, but have no distance. each: every picture is
    searched all over, because none need have to do with the one before; else as often as in flight.
    """

    def __init__(
        self,
        size: tuple[int, int],
        lens: CameraIntrinsics | None,
        square_mm: float,
        dictionaries: Sequence[str] = (),
        tag_mm: float = 168.0,
        each: bool = False,
    ) -> None:
        width, height = size
        guess = CameraIntrinsics(width, height, width, width, (width - 1) / 2, (height - 1) / 2)
        self._lens, self._known = lens or guess, lens is not None
        expected = [MarkerSettings(entity=f"m{code}", code=code, square_mm=square_mm) for code in marker.VALID_CODES]
        for place, name in enumerate(dictionaries):
            tags = (TagSettings(dictionary=name, id=number, size_mm=tag_mm) for number in range(family_of(name).count))
            expected += [MarkerSettings(entity=f"t{place}_{tag.id}", tag=tag) for tag in tags]
        self._expected = {one.entity: one for one in expected}
        # A lens that is only guessed leaves residuals that are not the board's fault.
        settings = DetectorSettings() if lens is not None else DetectorSettings(max_residual_px=20.0)
        self._pipeline = Pipeline(self._lens, tuple(expected), settings, _EACH_PICTURE_HZ if each else _SEARCH_RATE_HZ)

    def look(self, shot: SourcePicture) -> Look:
        """Return the results for a picture."""
        stamp_ns = round(shot.at_s * NS_PER_S)
        windows = self._pipeline.windows(stamp_ns, shot.grey.shape)
        began_s = time.process_time()
        before = self._pipeline.counts.copy()
        sightings = self._pipeline.process(shot.grey, stamp_ns, lambda _entity: _NOWHERE)
        cpu_ms = (time.process_time() - began_s) * 1e3
        new = self._pipeline.counts - before
        marked = tuple(self._marked(self._expected[s.entity], s.margin, s.corners) for s in sightings)
        drawn = annotate.canvas(shot.grey)
        for window in windows:
            corners = np.array([[window.left, window.top], [window.right, window.top],
                                [window.right, window.bottom], [window.left, window.bottom]])  # fmt: skip
            annotate.outline(drawn, corners, annotate.NOTE)
        for one in marked:
            self._draw(drawn, one)
        look = Look(shot, marked, new["unknown"], new["mirrored"], cpu_ms, drawn)
        annotate.lines(drawn, [look.text.split(": ", 1)[0], f"{cpu_ms:.1f} ms, {_age(shot)}"])
        if not self._known:
            annotate.lines(drawn, ["", "", "no calibration: no distances"], annotate.BAD)
        return look

    def _marked(self, printed: MarkerSettings, margin: float, corners: Array) -> Marked:
        poses = planar_poses(corners, printed.printed.corners(), self._lens) if self._known else []
        best = min(poses, key=lambda pose: pose.squared_error, default=None)
        residual = math.sqrt(best.squared_error / (2 * len(corners) - 6)) if best is not None else math.nan
        return Marked(printed, margin, corners, best, residual)

    def _draw(self, drawn: Image, one: Marked) -> None:
        annotate.dots(drawn, one.corners, annotate.GOOD)
        name = str(one.printed.code if one.printed.tag is None else one.printed.tag.id)
        text = f"{name}  {_range(one)}"
        if one.pose is not None:
            length_m = (2.0 if one.printed.tag is None else 0.5) * one.printed.size_mm / 1000.0
            annotate.axes(drawn, one.pose.rotation, one.pose.translation, length_m, self._lens)
            text += f"  {one.residual_px:.2f} px"
        annotate.label(drawn, text, one.corners.max(axis=0), annotate.GOOD)


def _range(one: Marked) -> str:
    return f"at {one.range_m:.2f} m" if one.pose is not None else "somewhere"


def _age(shot: SourcePicture) -> str:
    return f"{shot.age_ms:.0f} ms after it came"
