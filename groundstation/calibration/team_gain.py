"""Gain of new settings: today's tracker re-runs the recording under the old field and the new one."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

import msgspec
import numpy as np

from groundstation.bus.messages import Message, RelativeObservation
from groundstation.calibration.flown import Flown
from groundstation.calibration.team_paths import TargetPath
from groundstation.field.resolved import ResolvedField
from groundstation.time_units import NS_PER_S
from groundstation.tracker import tracker_from_field

_EVERY, _SETTLING_S = 5, 3.0


@dataclass(frozen=True, slots=True)
class Gain:
    """The tracker's error (rms) [m] against the targets' likeliest paths: as flown, and with new settings."""

    before_m: float
    after_m: float


def gain(flown: Flown, field: ResolvedField, new: ResolvedField, targets: Mapping[str, TargetPath]) -> Gain | None:
    """Return the gain; None where no target was seen often enough."""
    before, after = _distance_m(flown, field, targets), _distance_m(redetected(flown, field, new), new, targets)
    return None if np.isnan(before) or np.isnan(after) else Gain(before, after)


def _distance_m(flown: Flown, field: ResolvedField, targets: Mapping[str, TargetPath]) -> float:
    tracker, zero_ns = tracker_from_field(field, flown.clock, 1), flown.ticks[0][0]
    joined: dict[str, float] = {}
    squares = []
    for tick, (now_ns, inputs) in enumerate(flown.ticks):
        for key, message in inputs:
            tracker.ingest(key, message, now_ns)
        tracker.advance(now_ns)
        tracker.take_notices()
        tracker.take_corrections()
        at_s = (now_ns - zero_ns) / NS_PER_S
        for name in targets:
            if (
                name in tracker.belief.layout
                and at_s - joined.setdefault(name, at_s) > _SETTLING_S
                and tick % _EVERY == 0
            ):
                place = targets[name].poses(np.array([at_s]))[0, :2]
                squares.append(float(np.sum((tracker.belief.mean_of(name)[:2] - place) ** 2)))
    return float(np.sqrt(np.mean(squares))) if squares else float("nan")


def redetected(flown: Flown, old: ResolvedField, new: ResolvedField) -> Flown:
    """Return a recording as the cameras' processes would have published it under another field."""

    def again(message: Message) -> Message:
        return _again(message, old, new) if isinstance(message, RelativeObservation) else message

    ticks = tuple((now, tuple((key, again(message)) for key, message in inputs)) for now, inputs in flown.ticks)
    return replace(flown, ticks=ticks)


def _again(o: RelativeObservation, old: ResolvedField, new: ResolvedField) -> RelativeObservation:
    if not ({o.observer, o.subject} <= {*old.cameras, *old.drones, *old.tracked}):
        return o
    (turned, late_ms, focal), size = _camera(old, o.observer), _size(new, o.subject) / _size(old, o.subject)
    turned_now, late_now_ms, focal_now = _camera(new, o.observer)
    x, y, z = (value * size for value in o.position_m)
    yaw = None if o.yaw_rad is None else math.remainder(o.yaw_rad + turned_now - turned, math.tau)
    header = msgspec.structs.replace(o.header, stamp_ns=o.header.stamp_ns - round((late_now_ms - late_ms) * 1e6))
    return msgspec.structs.replace(o, header=header, position_m=(x, y, z * focal_now / focal), yaw_rad=yaw)


def _camera(field: ResolvedField, name: str) -> tuple[float, float, float]:
    """Return a camera's turn about the vertical [rad], delay [ms] and focal length [px]."""
    if name in field.cameras:
        fixed = field.cameras[name]
        return math.radians(fixed.rotation_deg[2]), fixed.video_delay_ms, fixed.calibration.fx_px
    eye = field.drones[name].camera
    return math.radians(eye.pan_left_deg), eye.video_delay_ms, eye.calibration.fx_px


def _size(field: ResolvedField, name: str) -> float:
    marker = field.drones[name].marker if name in field.drones else field.tracked[name].marker
    return marker.square_mm if marker.size_mm is None else marker.size_mm
