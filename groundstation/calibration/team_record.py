"""The data of a recording for the calibration of a team: own motion of each drone, sightings, and stands on pads."""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from groundstation.arrays import Array
from groundstation.bus.messages import (
    FlightState,
    ImuSample,
    Message,
    Odometry,
    RelativeObservation,
    VehicleStatus,
)
from groundstation.calibration.flown import Flown
from groundstation.estimation.attitude_intake import AttitudeIntake
from groundstation.estimation.parameters import parameters_from_field
from groundstation.field.resolved import ResolvedField
from groundstation.time_units import NS_PER_S

_STANDING = frozenset({FlightState.LANDED})
_UNKNOWN_YAW = 1e6
# During a shorter stand a person may still be placing the drone.
_LEAST_STAND_S = 0.5
# Sightings this near to a jump of a drone's own heading, or to the end of a known motion, are left out: a suspected
# delay would move them beyond it [s].
_JUMP_S, _EDGE_S = 0.4, 0.15
# A longer silence of a drone's odometry hides how it moved [s].
_SILENT_S = 0.3


@dataclass(frozen=True, slots=True)
class OwnMotion:
    """A drone by its own sensors, n samples.

    times [s]; velocities (n, 2) [m/s; base_stabilized]; yaw [rad; odom], roll, pitch [rad]; height [m] or NaN; resets
    of the heading; attitude_std [rad], yaw_std [rad per root second], 0: as the field has them.
    """

    times: Array
    velocities: Array
    yaw: Array
    roll: Array
    pitch: Array
    height: Array
    resets: Array
    attitude_std: Array
    yaw_std: Array

    def shows(self, at_s: float) -> bool:
        """Return whether the motion about a time is known, without a jump of the heading."""
        first, last = np.searchsorted(self.times, (at_s - _JUMP_S, at_s + _JUMP_S))
        jumps = first < last and self.resets[first] != self.resets[min(last, len(self.times) - 1)]
        if jumps or not self.times[0] + _EDGE_S <= at_s <= self.times[-1] - _EDGE_S:
            return False
        after = int(np.searchsorted(self.times, at_s, side="right"))
        return bool(self.times[after] - self.times[after - 1] <= _SILENT_S)


@dataclass(frozen=True, slots=True)
class Sightings:
    """n sightings: stamps [s], names of observers and subjects, centre [m; camera_optical] and heading (n, 4).

    covariance: (n, 4, 4); where no heading is known its variance is large. other: the second pose, or NaN.
    """

    times: Array
    observers: tuple[str, ...]
    subjects: tuple[str, ...]
    seen: Array
    covariance: Array
    other: Array


@dataclass(frozen=True, slots=True)
class TeamRecord:
    """The data of a recording; stands: begin and end [s] of each drone's stand before its first flight."""

    own: Mapping[str, OwnMotion]
    sightings: Sightings
    stands: Mapping[str, tuple[float, float]]
    duration_s: float

    def shows(self, names: Iterable[str], at_s: float) -> bool:
        """Return whether the motion of all these entities is known about a time.

        Sightings arrive late: those that come first are older than the first odometry, and than all paths.
        """
        within = _EDGE_S <= at_s <= self.duration_s - _EDGE_S
        return within and all(self.own[name].shows(at_s) for name in names if name in self.own)


def team_record(flown: Flown, field: ResolvedField) -> TeamRecord:
    """Return the data of a flight; times count from its first tick."""
    zero_ns = flown.ticks[0][0]
    reports = _OwnReports(flown, field)
    for message in _messages(flown):
        if message.header.entity in field.drones:
            reports.take(message, (message.header.stamp_ns - zero_ns) / NS_PER_S)
    return TeamRecord(reports.own(), _sightings(flown, field, zero_ns), reports.stands(), flown.duration_s)


class _OwnReports:
    """Collects what drones report of themselves: their motion, and when they stand on their pads."""

    def __init__(self, flown: Flown, field: ResolvedField) -> None:
        self._intake = AttitudeIntake(parameters_from_field(field).inertial)
        self._rows: dict[str, list[tuple[float, ...]]] = {name: [] for name in field.drones}
        self._stands: dict[str, list[float]] = {name: [] for name in field.drones}
        self._standing = dict.fromkeys(field.drones, True)
        self._flew = set(flown.off_pads)

    def take(self, message: Message, at_s: float) -> None:
        """Take a message about a drone."""
        name = message.header.entity
        if isinstance(message, VehicleStatus) and message.flight_state is not FlightState.UNKNOWN:
            self._standing[name] = message.flight_state in _STANDING
            if not self._standing[name]:
                self._flew.add(name)
            elif name not in self._flew:  # after its first flight it may stand anywhere
                self._stands[name].append(at_s)
        elif isinstance(message, ImuSample):
            self._intake.imu(message, message.header.stamp_ns, self._standing[name])
        elif isinstance(message, Odometry):
            self._rows[name].append(_row(self._intake, message, at_s))

    def own(self) -> dict[str, OwnMotion]:
        """Return the motion of each drone that reported it."""
        return {name: _own(found) for name, found in self._rows.items() if len(found) > 1}

    def stands(self) -> dict[str, tuple[float, float]]:
        """Return begin and end [s] of each drone's stand before its first flight, if it was long enough."""
        spans = {name: (times[0], times[-1]) for name, times in self._stands.items() if times}
        return {name: span for name, span in spans.items() if span[1] - span[0] >= _LEAST_STAND_S}


def _row(intake: AttitudeIntake, message: Odometry, at_s: float) -> tuple[float, ...]:
    sample = intake.motion(message, message.header.stamp_ns)
    height = np.nan if sample.height_m is None else sample.height_m
    vx, vy, _ = sample.velocity_m_s
    attitude = (sample.yaw_rad, sample.roll_rad, sample.pitch_rad)
    return (at_s, vx, vy, *attitude, height, sample.reset, sample.attitude_std_rad, sample.yaw_std_rad)


def _own(rows: list[tuple[float, ...]]) -> OwnMotion:
    table = np.array(rows, dtype=np.float64)
    table = table[np.unique(table[:, 0], return_index=True)[1]]
    at, vx, vy, yaw, roll, pitch, height, resets, attitude_std, yaw_std = np.ascontiguousarray(table.T)
    return OwnMotion(at, np.column_stack((vx, vy)), np.unwrap(yaw), roll, pitch, height, resets, attitude_std, yaw_std)


def _messages(flown: Flown) -> Iterator[Message]:
    for _, inputs in flown.ticks:
        for _, message in inputs:
            if message.header.clock == flown.clock:
                yield message


def _sightings(flown: Flown, field: ResolvedField, zero_ns: int) -> Sightings:
    observers = {*field.cameras, *field.drones}
    subjects = {*field.drones, *field.tracked}
    found = [
        m
        for m in _messages(flown)
        if isinstance(m, RelativeObservation) and m.observer in observers and m.subject in subjects
    ]
    found.sort(key=lambda m: m.header.stamp_ns)
    n = len(found)
    seen, other, covariance = np.full((n, 4), np.nan), np.full((n, 4), np.nan), np.zeros((n, 4, 4))
    for i, m in enumerate(found):
        seen[i, :3], seen[i, 3] = m.position_m, 0.0 if m.yaw_rad is None else m.yaw_rad
        rows = 3 if m.yaw_rad is None else 4
        covariance[i, 3, 3] = _UNKNOWN_YAW
        covariance[i, :rows, :rows] = np.reshape(m.covariance, (rows, rows))
        if m.alternative is not None:
            yaw = m.alternative.yaw_rad
            other[i, :3], other[i, 3] = m.alternative.position_m, seen[i, 3] if yaw is None else yaw
    times = np.array([(m.header.stamp_ns - zero_ns) / NS_PER_S for m in found])
    return Sightings(times, tuple(m.observer for m in found), tuple(m.subject for m in found), seen, covariance, other)
