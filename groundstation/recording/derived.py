"""Derived channels for viewers: where every frame is (`/tf`), and events as log lines (`/log`)."""

import math
from collections.abc import Callable

import msgspec

from groundstation.bus.messages import Severity
from groundstation.bus.topics import ESTIMATE, EVENT
from groundstation.field.drones import camera_name
from groundstation.field.resolved import ResolvedField
from groundstation.geometry.angles import quaternion_from_euler
from groundstation.geometry.rotations import (
    base_from_tilted_optical,
    euler_from_rotation,
    world_from_downward_optical,
)
from groundstation.recording.capture import Entry
from groundstation.recording.schemas import well_known
from groundstation.recording.viewers import LOG_CHANNEL, TF_CHANNEL, Transform, frame_transforms, log_line
from groundstation.time_units import NS_PER_MS

WORLD = "world"
# Viewers interpolate between transforms; the estimate itself is recorded at its full rate.
_TF_PERIOD_NS = 100 * NS_PER_MS
_FACTS = {"derived": "for viewers"}


class _Entity(msgspec.Struct, gc=False):
    name: str
    mean: tuple[float, ...]


class _Estimate(msgspec.Struct):
    entities: tuple[_Entity, ...]


class _Event(msgspec.Struct):
    severity: Severity
    text: str
    remedy: str = ""


_estimate = msgspec.json.Decoder(_Estimate)
_event = msgspec.json.Decoder(_Event)


def camera_frames(field: ResolvedField) -> tuple[Transform, ...]:
    """Return the optical frame of every camera of a resolved field, by its name on the bus."""
    fixed, carried = [], []
    for name, camera in field.cameras.items():
        rotation = world_from_downward_optical(camera.rotation_deg)
        turn = quaternion_from_euler(*euler_from_rotation(rotation))
        fixed.append(Transform(WORLD, name, camera.position_m, turn))
    for name, drone in field.drones.items():
        own = drone.camera
        tilt, pan = math.radians(own.tilt_down_deg), math.radians(own.pan_left_deg)
        turn = quaternion_from_euler(*euler_from_rotation(base_from_tilted_optical(tilt, pan)))
        carried.append(Transform(name, camera_name(name), own.position_m, turn))
    return (*fixed, *carried)


class ViewerChannels:
    """Makes the entries of `/tf` and `/log` from entries that are recorded anyway."""

    def __init__(self, cameras: tuple[Transform, ...] = ()) -> None:
        self._cameras = cameras
        self._next_ns = 0
        self._makers: dict[str, Callable[[Entry], Entry | None]] = {
            ESTIMATE.name: self._transforms,
            EVENT.name: self._log,
        }

    def derived(self, entry: Entry) -> Entry | None:
        """Return the viewers' extra message for an entry; None where there is nothing to add, or nothing readable."""
        make = self._makers.get(entry.facts["topic"])
        if make is None:
            return None
        try:
            return make(entry)
        except (msgspec.DecodeError, ValueError, RecursionError):
            return None  # malformed inside; the entry itself is recorded as it came

    def _transforms(self, entry: Entry) -> Entry | None:
        now_ns = entry.publish_time_ns
        if self._next_ns - _TF_PERIOD_NS <= now_ns < self._next_ns:
            return None
        self._next_ns = now_ns + _TF_PERIOD_NS
        bodies = tuple(_body(one) for one in _estimate.decode(entry.data).entities)
        return self._entry(entry, TF_CHANNEL, "FrameTransforms", frame_transforms(now_ns, bodies + self._cameras))

    def _log(self, entry: Entry) -> Entry:
        event = _event.decode(entry.data)
        text = f"{event.text} ({event.remedy})" if event.remedy else event.text
        line = log_line(entry.publish_time_ns, event.severity, entry.facts["entity"], text)
        return self._entry(entry, LOG_CHANNEL, "Log", line)

    def _entry(self, source: Entry, channel: str, kind: str, data: bytes) -> Entry:
        times = source.log_time_ns, source.publish_time_ns
        return Entry(channel, *times, source.sequence, data, well_known(f"foxglove.{kind}"), _FACTS, derived=True)


def _body(entity: _Entity) -> Transform:
    if len(entity.mean) >= 4:
        x, y, z, yaw = entity.mean[:4]
        return Transform(WORLD, entity.name, (x, y, z), quaternion_from_euler(0.0, 0.0, yaw))
    x, y = entity.mean[:2]
    return Transform(WORLD, entity.name, (x, y, 0.0), (1.0, 0.0, 0.0, 0.0))
