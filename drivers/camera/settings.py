"""Settings of one camera driver, as the composition hands them over (JSON of `CameraDriverSettings`)."""

from enum import StrEnum
from typing import Annotated, Literal

import numpy as np
from pydantic import AfterValidator, BaseModel, ConfigDict, Field, model_validator

from drivers.camera.source_address import parse_source
from groundstation.geometry.board import VALID_CODES, Checkerboard
from groundstation.geometry.lens import CameraIntrinsics, intrinsics_of
from groundstation.geometry.tag import SquareTag

_Positive = Annotated[float, Field(gt=0)]
_Name = Annotated[str, Field(pattern=r"^[a-z][a-z0-9_]{0,47}$")]


SEARCH_RATE_HZ = 2.0
"""How often whole pictures are searched in which nothing is in view."""


def _checked_source(text: str) -> str:
    parse_source(text)
    return text


class _Section(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)


class CalibrationSettings(_Section):
    """A calibration file, inlined."""

    schema_version: Literal[1] = 1
    model: Literal["plumb_bob"] = "plumb_bob"
    width_px: Annotated[int, Field(gt=0, le=8192)]
    height_px: Annotated[int, Field(gt=0, le=8192)]
    fx_px: _Positive
    fy_px: _Positive
    cx_px: float
    cy_px: float
    distortion: tuple[float, float, float, float, float] = (0.0, 0.0, 0.0, 0.0, 0.0)
    residual_px: Annotated[float, Field(ge=0)] = 0.2
    date: str = ""

    def intrinsics(self) -> CameraIntrinsics:
        """Return the lens model."""
        return intrinsics_of(self)


class MarkerKind(StrEnum):
    """Kinds of carriers of a marker."""

    ROBOT = "robot"
    TARGET = "target"


class TagSettings(_Section):
    """A tag of an ArUco or AprilTag dictionary; size_mm: the side of its black square."""

    dictionary: str
    id: int
    size_mm: Annotated[float, Field(gt=1, le=2000)]

    @model_validator(mode="after")
    def _known(self) -> "TagSettings":
        SquareTag(self.dictionary, self.id, self.size_mm)
        return self


class MarkerSettings(_Section):
    """A marker that may come into view: its carrier, its place on the carrier [m; base], and its print.

    The print is a checkerboard (code, square_mm) or a tag.
    """

    entity: _Name
    code: Annotated[int, Field(ge=min(VALID_CODES), le=max(VALID_CODES))] | None = None
    square_mm: Annotated[float, Field(gt=1, le=1000)] | None = None
    tag: TagSettings | None = None
    position_m: tuple[float, float, float] = (0.0, 0.0, 0.0)
    kind: MarkerKind = MarkerKind.ROBOT

    @model_validator(mode="after")
    def _complete(self) -> "MarkerSettings":
        if (self.code is None or self.square_mm is None) == (self.tag is None):
            raise ValueError(f"marker of {self.entity}: needs either code and square_mm, or tag")
        return self

    @property
    def printed(self) -> Checkerboard | SquareTag:
        """Return its layout."""
        if self.tag is not None:
            return SquareTag(self.tag.dictionary, self.tag.id, self.tag.size_mm)
        assert self.code is not None and self.square_mm is not None
        return Checkerboard(self.code, self.square_mm)

    @property
    def label(self) -> str:
        """Return its name for the operator."""
        return f"marker {self.code}" if self.tag is None else f"tag {self.tag.dictionary} {self.tag.id}"

    @property
    def size_mm(self) -> float:
        """Return the length that a ruler is put to: the side of a square, or of a tag."""
        return self.tag.size_mm if self.tag is not None else self.square_mm or 0.0

    @property
    def reach_m(self) -> float:
        """Return how far its corners are from its centre [m]."""
        return float(np.linalg.norm(self.printed.corners(), axis=1).max())


class MountSettings(_Section):
    """Where the camera is: `parent` "world", or the robot that carries it.

    On a robot: position [m; base], tilted down and panned left. In the world: position [m; world] and `looking`
    (down: picture x axis along world +x, picture y axis along world -y), turned from there by `rotation_deg` (roll,
    pitch, yaw about the world's axes).
    """

    parent: str = "world"
    position_m: tuple[float, float, float] = (0.0, 0.0, 0.0)
    tilt_down_deg: Annotated[float, Field(ge=-90, le=90)] = 0.0
    pan_deg: Annotated[float, Field(ge=-180, le=180)] = 0.0
    looking: Literal["down"] | None = None
    rotation_deg: tuple[float, float, float] = (0.0, 0.0, 0.0)

    @property
    def in_world(self) -> bool:
        """Return whether the camera is fixed in the world."""
        return self.parent == "world"


class DetectorSettings(_Section):
    """Figures of the detector; the defaults are measured (reference: vision).

    corner_floor_px: least standard deviation assumed of a corner; tracked_search_rate_hz: full searches while every
    expected marker is tracked; sought_search_rate_hz: while something that is sought is out of view (a target that no
    camera sees, a robot that a fixed one should); search_share: the share of a processor's time that those may take;
    ambiguity_cost: cost difference (chi-square units) below which both poses are reported.
    """

    corner_floor_px: Annotated[float, Field(ge=0.01, le=5)] = 0.02
    identity_margin: Annotated[float, Field(ge=1, le=4)] = 1.0
    tracked_search_rate_hz: Annotated[float, Field(gt=0, le=2)] = 0.5
    sought_search_rate_hz: Annotated[float, Field(gt=0, le=30)] = 8.0
    search_share: Annotated[float, Field(gt=0, le=1)] = 0.15
    max_residual_px: _Positive = 1.5
    ambiguity_cost: _Positive = 6.0


class CameraDriverSettings(_Section):
    """All that `drivers.camera.driver.run` needs.

    name: of the camera on the bus; observer: the observer in sightings (the carrier, or the camera's own name
    when it is fixed in the world; derived when empty); observes: entities to report (empty: all markers, but for a
    world-fixed camera robots only); search_phase_s: staggers the full searches of several cameras; start_within_s,
    stall_after_s: how long the first picture, and any later one, may take before the operator is warned.
    """

    name: _Name
    source: Annotated[str, AfterValidator(_checked_source)]
    calibration: CalibrationSettings
    mount: MountSettings = MountSettings()
    video_delay_ms: Annotated[float, Field(ge=0, le=2000)] = 120.0
    readout_ms: Annotated[float, Field(ge=0, le=100)] = 0.0
    markers: tuple[MarkerSettings, ...] = ()
    observes: tuple[str, ...] = ()
    image_fps: Annotated[float, Field(ge=0, le=5)] = 5.0
    search_rate_hz: Annotated[float, Field(gt=0, le=2)] = SEARCH_RATE_HZ
    search_phase_s: Annotated[float, Field(ge=0)] = 0.0
    start_within_s: _Positive = 5.0
    stall_after_s: _Positive = 1.0
    detector: DetectorSettings = DetectorSettings()

    @property
    def observer(self) -> str:
        """Return the observer of its sightings: the camera, or the drone that carries it."""
        return self.name if self.mount.in_world else self.mount.parent

    @property
    def expected_markers(self) -> tuple[MarkerSettings, ...]:
        """Return the markers this camera reports: never its own carrier's; world-fixed ones report robots only."""
        wanted = [m for m in self.markers if m.entity != self.observer]
        if self.observes:
            return tuple(m for m in wanted if m.entity in self.observes)
        return tuple(m for m in wanted if not (self.mount.in_world and m.kind is MarkerKind.TARGET))

    @model_validator(mode="after")
    def _check(self) -> "CameraDriverSettings":
        labels = [marker.label for marker in self.markers]
        if len(set(labels)) != len(labels):
            raise ValueError("markers: two markers share a code")
        if self.mount.in_world and self.mount.looking is None:
            raise ValueError("mount.looking: a camera fixed in the world needs it (down)")
        self.calibration.intrinsics()
        return self
