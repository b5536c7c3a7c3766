"""Finds the delay of each sensor in a recorded flight, by comparing measurements of the same motion.

A fixed camera sees headings, which a vehicle's gyroscopes report without delay: that gives the camera's delay. Its
positions then give the delays of the vehicles' velocities and heights. Delays of cameras on vehicles come from the
filter, which predicts all sightings worse if one delay is wrong.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np

from groundstation.arrays import Array
from groundstation.bus.messages import Message, Odometry, RelativeObservation
from groundstation.calibration.camera_delays import onboard_cameras
from groundstation.calibration.flown import Flown
from groundstation.calibration.sensor_delay import LEAST_SEEN, Delay
from groundstation.calibration.time_offset import (
    FAR_S,
    Change,
    Part,
    across,
    briefly,
    interpolated,
    rate_hz,
    shift_between,
)
from groundstation.estimation.models import OdometryRobot
from groundstation.estimation.parameters import parameters_from_field
from groundstation.field.drones import FieldDrone
from groundstation.field.resolved import ResolvedField
from groundstation.field.room import WorldCamera
from groundstation.geometry.rotations import rotation_from_euler, world_from_downward_optical

M = TypeVar("M", bound=Message)

# The delay of a height needs climbs of this much within the window, for this long.
_CLIMB_M, _CLIMBING_S = 0.2, 10.0
# Between two resets a heading drifts as a parabola, if it was seen for long enough.
_DRIFTING = 2
_TURN = "turn the drones to and fro in its sight, or let the target circle them"
_DASH = "dash to and fro in sight of a fixed camera, or chase a target that keeps turning back; or fly four minutes"
_CLIMB = "take off and land some five times in sight of a fixed camera, in one recording"


@dataclass(frozen=True, slots=True)
class _Track:
    """A robot as a fixed camera saw it: times [s], positions (n, 3) of its marker [m; world], headings [rad]."""

    times: Array
    positions: Array
    headings: Array


# For a field without a fixed camera: motion capture and ranges determine no delay yet.
_UNSEEN = _Track(np.empty(0), np.empty((0, 3)), np.empty(0))


@dataclass(frozen=True, slots=True)
class _Own:
    """A robot as it reported itself: times [s], velocities (n, 2) [base_stabilized], heading, roll, pitch, height.

    resets: of the heading, counted.
    """

    times: Array
    velocities: Array
    heading: Array
    roll: Array
    pitch: Array
    height: Array
    resets: Array

    def block(self, begin: Array, end: Array) -> Array:
        """Return the number of resets before each span, NaN where one is in it: under any delay that is searched."""
        last = len(self.times) - 1
        first = np.searchsorted(self.times, begin + FAR_S[0], side="right") - 1
        second = np.searchsorted(self.times, end + FAR_S[1])
        resets = self.resets[np.clip(first, 0, last)]
        return np.where(resets == self.resets[np.clip(second, 0, last)], resets, np.nan)

    def without_jumps(self, change: Change, times: Array) -> Change:
        """Return the changes across which the heading has no reset."""
        kept = np.isfinite(self.block(times[change.before], times[change.second]))
        return replace(change, before=change.before[kept], first=change.first[kept], second=change.second[kept])


def delays(flown: Flown, resolved: ResolvedField) -> list[Delay]:
    """Return the delays of every camera, and of velocity and height of every robot."""
    own = {name: _own(flown, name) for name in resolved.drones}
    models = parameters_from_field(resolved).entities
    habits = {name: model for name, model in models.items() if isinstance(model, OdometryRobot)}
    found: list[Delay] = []
    exposure_s: dict[str, float] = {}
    for name, camera in resolved.cameras.items():
        tracks = {drone: _track(flown, name, camera, drone) for drone in own}
        one = _fixed_camera(name, camera, tracks, own)
        found.append(one)
        exposure_s[name] = (one.now_ms - (one.measured_ms or one.now_ms)) / 1e3 if one.sure else 0.0
    for drone, settings in resolved.drones.items():
        seen = [(name, _track(flown, name, camera, drone)) for name, camera in resolved.cameras.items()]
        name, track = max(seen, key=lambda pair: len(pair[1].times), default=("", _UNSEEN))
        moved = _Track(track.times + exposure_s.get(name, 0.0), track.positions, track.headings)
        found += _odometry(drone, settings, habits[drone], moved, own[drone])
    fixed = {one.sensor: one for one in found if one.sensor in resolved.cameras}
    return found + onboard_cameras(flown, resolved, fixed)


def _track(flown: Flown, name: str, camera: WorldCamera, drone: str) -> _Track:
    rotation = world_from_downward_optical(camera.rotation_deg)
    rows = {}
    for message in _messages(flown, RelativeObservation):
        if message.observer == name and message.subject == drone and message.yaw_rad is not None:
            place = rotation @ np.array(message.position_m) + camera.position_m
            rows[message.header.stamp_ns] = (*place, message.yaw_rad)
    table = np.array([(stamp, *row) for stamp, row in sorted(rows.items())], dtype=np.float64).reshape(-1, 5)
    return _Track(_seconds(flown, table[:, 0]), table[:, 1:4], np.unwrap(table[:, 4]))


def _own(flown: Flown, drone: str) -> _Own:
    rows = {}
    for m in _messages(flown, Odometry):
        if m.header.entity == drone:
            height = np.nan if m.height_m is None else m.height_m
            rows[m.header.stamp_ns] = (*m.velocity_m_s[:2], m.yaw_rad, m.roll_rad, m.pitch_rad, height, m.reset)
    table = np.array([(stamp, *row) for stamp, row in sorted(rows.items())], dtype=np.float64).reshape(-1, 8)
    yaw = np.unwrap(table[:, 3])
    roll, pitch, height, resets = table[:, 4:].T
    return _Own(_seconds(flown, table[:, 0]), table[:, 1:3], yaw, roll, pitch, height, resets)


def _messages(flown: Flown, kind: type[M]) -> list[M]:
    return [message for _, inputs in flown.ticks for _, message in inputs if isinstance(message, kind)]


def _seconds(flown: Flown, stamps_ns: Array) -> Array:
    return (stamps_ns - flown.ticks[0][0]) / 1e9


def _fixed_camera(name: str, camera: WorldCamera, tracks: Mapping[str, _Track], own: Mapping[str, _Own]) -> Delay:
    now_ms = camera.video_delay_ms
    parts: list[Part] = []
    for drone, track in tracks.items():
        if len(track.times) > LEAST_SEEN and len(own[drone].times) > LEAST_SEEN:
            mine = own[drone]
            turned = interpolated(mine.times, mine.heading[:, None])
            change = mine.without_jumps(across(track.times), track.times)
            parts.append(Part(track.times, track.headings[:, None], turned, change))
    shift = shift_between(parts, scaled=False, within_s=FAR_S)
    if shift is None:
        return Delay(
            name,
            f"cameras.{name}.video_delay_ms",
            now_ms,
            reason="it saw too little of any drone's turning, or its delay is off by more than 0.4 s",
            flight=_TURN,
        )
    # A later exposure than assumed means a shorter transmission delay.
    return Delay(name, f"cameras.{name}.video_delay_ms", now_ms, now_ms - 1e3 * shift[0], 1e3 * shift[1], flight=_TURN)


def _odometry(drone: str, settings: FieldDrone, habits: OdometryRobot, track: _Track, own: _Own) -> list[Delay]:
    now = settings.odometry
    velocity = height = None
    still = level = "no fixed camera saw it long enough"
    if len(track.times) >= LEAST_SEEN and len(own.times) >= LEAST_SEEN:
        body = _body_positions(track, own, settings.marker.position_m)
        velocity = _velocity_shift(track, own, body[:, :2], habits.velocity_bias_correlation_s)
        height = _height_shift(track, own, body[:, 2:])
        still = "it moved too little in sight of a fixed camera"
        level = "it climbed too little, or reports no height"
    return [
        _reported(drone, "velocity", now.velocity_delay_ms, velocity, still, _DASH),
        _reported(drone, "height", now.height_delay_ms, height, level, _CLIMB),
    ]


def _reported(
    drone: str, kind: str, now_ms: float, shift_s: tuple[float, float] | None, reason: str, flight: str
) -> Delay:
    """Return the delay of a drone's velocities or heights; reason: why it is not known, where it is not."""
    name, key = f"{drone} {kind}", f"drones.{drone}.odometry.{kind}_delay_ms"
    if shift_s is None:
        return Delay(name, key, now_ms, reason=reason, flight=flight)
    return Delay(name, key, now_ms, 1e3 * shift_s[0], 1e3 * shift_s[1], flight=flight)


def _velocity_shift(track: _Track, own: _Own, seen_m: Array, lasting_s: float) -> tuple[float, float] | None:
    brief = own.without_jumps(briefly(track.times, lasting_s), track.times)
    return shift_between([Part(track.times, seen_m, _path(track, own), brief)], True)


def _height_shift(track: _Track, own: _Own, seen_m: Array) -> tuple[float, float] | None:
    known, in_a_second = np.isfinite(own.height), across(track.times)
    climbing = np.abs(in_a_second(seen_m)) > _CLIMB_M
    if known.sum() <= LEAST_SEEN or climbing.sum() < _CLIMBING_S * rate_hz(track.times):
        return None
    reported = interpolated(own.times[known], own.height[known, None])
    return shift_between([Part(track.times, seen_m, reported, in_a_second)], False)


def _body_positions(track: _Track, own: _Own, marker_m: tuple[float, float, float]) -> Array:
    """Return the path of the drone's centre from that of its marker, which tilts with it."""
    lean = [np.interp(track.times, own.times, angle) for angle in (own.roll, own.pitch)]
    offsets = [
        rotation_from_euler(roll, pitch, yaw) @ marker_m for roll, pitch, yaw in zip(*lean, track.headings, strict=True)
    ]
    return track.positions - np.array(offsets)


def _path(track: _Track, own: _Own) -> Callable[[Array, float], Array]:
    """Return (times, delay) -> positions, integrated from the reported velocities under this delay."""
    gaps = track.headings - np.interp(track.times, own.times, own.heading)
    blocks, corrected = own.block(track.times, track.times), own.heading.copy()
    for one in np.unique(own.resets):
        seen, mine = blocks == one, own.resets == one
        if seen.any():
            times = track.times[seen]
            degree = _DRIFTING if len(times) >= LEAST_SEEN else 0
            drift = np.polynomial.Polynomial.fit(times, np.unwrap(gaps[seen]), degree)
            corrected[mine] += drift(np.clip(own.times[mine], times[0], times[-1]))

    def path(times: Array, delay_s: float) -> Array:
        then = own.times - delay_s
        heading = np.interp(then, own.times, corrected)
        c, s = np.cos(heading), np.sin(heading)
        vx, vy = own.velocities.T
        world = np.column_stack((c * vx - s * vy, s * vx + c * vy))
        steps = 0.5 * np.diff(own.times)[:, None] * (world[1:] + world[:-1])
        summed = np.vstack((np.zeros((1, 2)), np.cumsum(steps, axis=0)))
        return np.column_stack([np.interp(times, then, summed[:, k]) for k in range(2)])

    return path
