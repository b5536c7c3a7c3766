"""Derived channels for viewers: frames, trajectories, events as log lines, lenses and marks in pictures."""

import math
from collections.abc import Callable

import msgspec

from groundstation.appearance.colours import colours_of
from groundstation.bus.messages import Header, Severity
from groundstation.bus.topics import CAMERA_STATUS, ESTIMATE, EVENT, OBSERVATION
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
from groundstation.recording.trajectories import Trajectories
from groundstation.recording.viewer_pictures import ANNOTATIONS_PREFIX, CALIBRATION_PREFIX, annotations, calibration
from groundstation.recording.viewers import (
    LOG_CHANNEL,
    TF_CHANNEL,
    TRAJECTORY_PREFIX,
    Transform,
    frame_transforms,
    log_line,
    poses_in_frame,
    stamp,
)
from groundstation.time_units import NS_PER_MS
from groundstation.vectors import Vector3

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


class _Sighting(msgspec.Struct):
    header: Header
    subject: str
    camera: str
    position_m: Vector3


_estimate = msgspec.json.Decoder(_Estimate)
_event = msgspec.json.Decoder(_Event)
_sighting = msgspec.json.Decoder(_Sighting)


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
    """Makes the entries of viewers' channels from recorded entries."""

    def __init__(self, field: ResolvedField | None = None) -> None:
        self._cameras = camera_frames(field) if field else ()
        self._lenses = field.calibrations if field else {}
        self._colours = colours_of(field.drones, field.tracked) if field else {}
        # For the newest picture of each camera: its time, and the places of markers in it.
        self._seen: dict[str, tuple[int, dict[str, Vector3]]] = {}
        self._next_ns = 0
        self._trajectories = Trajectories()
        self._makers: dict[str, Callable[[Entry], tuple[Entry, ...]]] = {
            ESTIMATE.name: self._places,
            EVENT.name: self._log,
            CAMERA_STATUS.name: self._calibration,
            OBSERVATION.name: self._annotations,
        }

    def derived(self, entry: Entry) -> tuple[Entry, ...]:
        """Return the viewers' extra messages for an entry.

        None if there is nothing to add or the entry is unreadable.
        """
        make = self._makers.get(entry.facts["topic"])
        if make is None:
            return ()
        try:
            return make(entry)
        except (msgspec.DecodeError, ValueError, RecursionError):
            return ()  # malformed inside; the entry itself is recorded as received

    def _places(self, entry: Entry) -> tuple[Entry, ...]:
        now_ns = entry.publish_time_ns
        if self._next_ns - _TF_PERIOD_NS <= now_ns < self._next_ns:
            return ()
        self._next_ns = now_ns + _TF_PERIOD_NS
        bodies = tuple(_body(one) for one in _estimate.decode(entry.data).entities)
        frames = frame_transforms(now_ns, bodies + self._cameras)
        return (
            self._entry(entry, TF_CHANNEL, "FrameTransforms", frames),
            *(
                self._entry(entry, TRAJECTORY_PREFIX + name, "PosesInFrame", poses_in_frame(now_ns, WORLD, poses))
                for name, poses in self._trajectories.take(now_ns, bodies).items()
            ),
        )

    def _log(self, entry: Entry) -> tuple[Entry, ...]:
        event = _event.decode(entry.data)
        text = f"{event.text} ({event.remedy})" if event.remedy else event.text
        line = log_line(entry.publish_time_ns, event.severity, entry.facts["entity"], text)
        return (self._entry(entry, LOG_CHANNEL, "Log", line),)

    def _calibration(self, entry: Entry) -> tuple[Entry, ...]:
        camera = entry.facts["entity"]
        lens = self._lenses.get(camera)
        if lens is None:
            return ()
        data = calibration(stamp(entry.log_time_ns), camera, lens)
        return (self._entry(entry, CALIBRATION_PREFIX + camera, "CameraCalibration", data),)

    def _annotations(self, entry: Entry) -> tuple[Entry, ...]:
        sighting = _sighting.decode(entry.data)
        lens = self._lenses.get(sighting.camera)
        if lens is None:
            return ()
        taken_ns, seen = self._seen.get(sighting.camera, (0, {}))
        if taken_ns != sighting.header.stamp_ns:
            seen = {}
        seen[sighting.subject] = sighting.position_m
        self._seen[sighting.camera] = (sighting.header.stamp_ns, seen)
        data = annotations(stamp(entry.log_time_ns), lens, seen, self._colours)
        return (self._entry(entry, ANNOTATIONS_PREFIX + sighting.camera, "ImageAnnotations", data),)

    def _entry(self, source: Entry, channel: str, kind: str, data: bytes) -> Entry:
        times = source.log_time_ns, source.publish_time_ns
        return Entry(channel, *times, source.sequence, data, well_known(f"foxglove.{kind}"), _FACTS, derived=True)


def _body(entity: _Entity) -> Transform:
    if len(entity.mean) >= 4:
        x, y, z, yaw = entity.mean[:4]
        return Transform(WORLD, entity.name, (x, y, z), quaternion_from_euler(0.0, 0.0, yaw))
    x, y = entity.mean[:2]
    return Transform(WORLD, entity.name, (x, y, 0.0), (1.0, 0.0, 0.0, 0.0))
