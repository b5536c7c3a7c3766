"""Finds figures that are permitted but unlikely: of another unit, or too small or large for a flight."""

import math
from collections.abc import Iterator
from dataclasses import dataclass

from pydantic import BaseModel

from drivers.motion_capture.settings import parse_source
from groundstation.settings.document import KeyPath
from groundstation.settings.motion_capture import MotionCaptureSettings
from groundstation.settings.parts import Finding
from groundstation.settings.schema import Field


@dataclass(frozen=True, slots=True)
class Likely:
    """Likely range of a setting, and the likely mistake or consequence outside of it; 0 is always accepted."""

    least: float
    most: float
    below: str = ""
    above: str = ""


_SECONDS, _RADIANS = "is this in seconds, not in ms?", "is this in radians, not in degrees?"
_DELAY = Likely(1.0, 5000.0, _SECONDS)
_NOTHING = "with such a deviation what is measured counts for nothing"
_CAMERA = {"video_delay_ms": _DELAY, "attitude_std_deg": Likely(0.01, 90.0, _RADIANS)}
_SYSTEM = {"delay_ms": Likely(0.2, 5000.0, _SECONDS)}
_CAPTURE = {"pose_std_m": Likely(1e-4, 0.5, "no system measures so well", _NOTHING)}
_RANGES = {"range_std_m": Likely(0.005, 1.0, "no radio measures so well", _NOTHING)}
_LIMITS = {
    "max_speed_m_s": Likely(0.05, 10.0, "drones would hardly move"),
    "max_climb_m_s": Likely(0.05, 10.0, "drones would hardly climb"),
    "max_yaw_rate_deg_s": Likely(5.0, 720.0, _RADIANS),
}
_ODOMETRY = {
    "velocity_delay_ms": _DELAY,
    "height_delay_ms": _DELAY,
    "velocity_std_m_s": Likely(0.001, 1.0, "no vehicle knows it so well", _NOTHING),
    "height_std_m": Likely(0.001, 1.0, "no vehicle knows it so well", _NOTHING),
    "attitude_std_deg": Likely(0.05, 9.0, _RADIANS),
    "yaw_rate_std_deg_s": Likely(0.02, 9.0, _RADIANS, _NOTHING),
    "velocity_scale": Likely(0.4, 2.5, "is this the reported speed over the true one?", "no vehicle errs so much"),
}
_ESTIMATOR = {
    "max_lateness_s": Likely(0.05, 60.0, "pictures come later than that now and then, and would be refused"),
    "lost_after_s": Likely(0.3, 60.0, "the team would search for a target that one picture does not show"),
}
_PLANNER = {"planned_range_m": Likely(0.3, 100.0, "plans would count on no sighting at all")}
_LEAST_HORIZON_S = 0.3
# Room for the rounding of a multiple of 45 degrees in radians, such as 1.57.
_ROUNDED_RAD = 2e-3
_NATNET_REQUESTS, _NATNET_FRAMES = 1510, 1511


def unlikely(field: Field) -> Iterator[Finding]:
    """Yield each setting with such a figure, and its likely mistake."""
    for name, camera in field.cameras.items():
        yield from _outside(("cameras", name), camera, _CAMERA)
    for name, drone in field.drones.items():
        path: KeyPath = ("drones", name)
        yield from _outside((*path, "limits"), drone.limits, _LIMITS)
        yield from _outside((*path, "camera"), drone.camera, _CAMERA)
        yield from _outside((*path, "odometry"), drone.odometry, _ODOMETRY)
        yield from _in_radians((*path, "pad_yaw_deg"), drone.pad_yaw_deg)
    for name, target in field.tracked.items():
        if target.odometry is not None:
            owner: KeyPath = ("targets", name) if field.target is None else ("target",)
            yield from _outside((*owner, "odometry"), target.odometry, _SYSTEM)
    for section, systems in (("motion_capture", field.motion_capture), ("ranging", field.ranging)):
        for name, system in systems.items():
            yield from _outside((section, name), system, _SYSTEM | (_RANGES if section == "ranging" else _CAPTURE))
    for name, capture in field.motion_capture.items():
        yield from _of_a_capture(("motion_capture", name), capture)
    yield from _outside(("estimator",), field.estimator, _ESTIMATOR)
    yield from _outside(("planner",), field.planner, _PLANNER)
    if (ahead_s := field.planner.horizon_steps * field.planner.step_s) < _LEAST_HORIZON_S:
        yield ("planner", "step_s"), f"lets plans look {ahead_s:g} s ahead: too short for any motion to pay"
    if field.recording.directory.startswith("~"):
        yield ("recording", "directory"), "is a folder of that very name: ~ is not your home in a field file"


def _of_a_capture(path: KeyPath, system: MotionCaptureSettings) -> Iterator[Finding]:
    yield from _in_radians((*path, "yaw_deg"), system.yaw_deg)
    for name, body in system.bodies.items():
        yield from _in_radians((*path, "bodies", name, "yaw_deg"), body.yaw_deg)
    address = parse_source(system.source)
    if address.scheme == "natnet" and address.port == _NATNET_FRAMES:
        text = f"asks at port {_NATNET_FRAMES}, to which frames are sent: the system answers at {_NATNET_REQUESTS}"
        yield (*path, "source"), text


def _in_radians(path: KeyPath, value: float) -> Iterator[Finding]:
    """Yield a heading that is a multiple of 45 degrees in radians."""
    eighths = round(value / (math.pi / 4))
    if 1 <= abs(eighths) <= 4 and abs(value - eighths * math.pi / 4) < _ROUNDED_RAD:
        yield path, f"is unlikely (got {value:g}): {_RADIANS}"


def _outside(path: KeyPath, section: BaseModel, figures: dict[str, Likely]) -> Iterator[Finding]:
    for key, likely in figures.items():
        value = float(getattr(section, key))
        text = likely.below if 0.0 < value < likely.least else likely.above if value > likely.most else ""
        if text:
            yield (*path, key), f"is unlikely (got {value:g}): {text}"
