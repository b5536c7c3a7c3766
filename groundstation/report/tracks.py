"""Time series of a run as arrays; times in seconds since the first message."""

import math
from dataclasses import dataclass, field
from typing import Generic, TypeVar

import numpy as np
from numpy.typing import NDArray

from groundstation.arrays import Array, BoolArray
from groundstation.bus.messages import (
    Belief,
    Command,
    CommandAck,
    Event,
    Innovation,
    Plan,
    SearchMap,
    Suspicion,
    VehicleStatus,
)
from groundstation.field.behaviour import PlannerValues, SafetyValues
from groundstation.field.resolved import ResolvedField
from groundstation.field.room import Fence, Room
from groundstation.field.targets import SingleTarget, TargetMarker
from groundstation.recording.rerun import Rerun
from groundstation.recording.stretch import Stretch
from groundstation.report.run_facts import RunFacts

T = TypeVar("T")


@dataclass(frozen=True, slots=True)
class TruthTrack:
    """True path of a body: time (n), position (n, 3), yaw (n), on_ground (n).

    max_gap_s: between two samples that are farther apart its place is unknown, as before the first and after the last;
    inf: of a simulator, which always knows it. on_ground of any other truth is the drone's own report.
    """

    time_s: Array
    position_m: Array
    yaw_rad: Array
    on_ground: BoolArray
    max_gap_s: float = math.inf

    @property
    def is_simulated(self) -> bool:
        """Return whether it is a simulator's, and so without gaps."""
        return math.isinf(self.max_gap_s)

    def known_at(self, time_s: Array) -> BoolArray:
        """Return for each time whether the place is known (m)."""
        if self.is_simulated:
            return np.ones(len(time_s), dtype=bool)
        after = np.searchsorted(self.time_s, time_s, side="left")
        before = np.searchsorted(self.time_s, time_s, side="right") - 1
        inside = (before >= 0) & (after < len(self.time_s))
        last = len(self.time_s) - 1
        gap_s = self.time_s[np.clip(after, 0, last)] - self.time_s[np.clip(before, 0, last)]
        known: BoolArray = inside & (gap_s <= self.max_gap_s)
        return known

    def stretches(self, start_s: float, end_s: float) -> list[NDArray[np.int64]]:
        """Return the indices of the samples between two times, as stretches without gaps."""
        inside = np.flatnonzero((self.time_s >= start_s) & (self.time_s <= end_s))
        return np.split(inside, np.flatnonzero(np.diff(self.time_s[inside]) > self.max_gap_s) + 1)

    def position_at(self, time_s: Array) -> Array:
        """Return interpolated positions (m, 3); NaN where unknown, a simulator's are held at both ends."""
        columns = [np.interp(time_s, self.time_s, self.position_m[:, axis]) for axis in range(3)]
        return np.where(self.known_at(time_s)[:, None], np.column_stack(columns), np.nan)

    def yaw_at(self, time_s: Array) -> Array:
        """Return interpolated yaw (m), unwrapped; NaN where unknown."""
        return np.where(self.known_at(time_s), np.interp(time_s, self.time_s, np.unwrap(self.yaw_rad)), np.nan)

    def airborne_at(self, time_s: Array) -> BoolArray:
        """Return whether the body flew (m); False outside the track and where unknown."""
        index = np.searchsorted(self.time_s, time_s, side="right") - 1
        inside = (index >= 0) & (time_s <= self.time_s[-1] + 0.5)
        flying: BoolArray = inside & ~self.on_ground[np.clip(index, 0, len(self.time_s) - 1)]
        return flying & self.known_at(time_s)


@dataclass(frozen=True, slots=True)
class EstimateTrack:
    """Estimates of an entity: time (n), mean (n, k), covariance (n, k, k)."""

    kind: str
    time_s: Array
    mean: Array
    covariance: Array

    def latest_at(self, time_s: Array, stale_s: float) -> NDArray[np.int64]:
        """Return the index (m) of the newest estimate at each time, -1 if there is none younger than stale_s."""
        index = np.searchsorted(self.time_s, time_s, side="right") - 1
        age = time_s - self.time_s[np.clip(index, 0, None)]
        return np.where((index >= 0) & (age <= stale_s), index, -1).astype(np.int64)


@dataclass(frozen=True, slots=True)
class CertaintyTrack:
    """How well the tracker knew an entity, as it said: time (n), age of the last observation (n), unlocalised (n) [s].

    doubted (n): a target is searched for, or sightings contradict a robot's place.
    """

    time_s: Array
    age_s: Array
    unlocalised_s: Array
    doubted: BoolArray


@dataclass(frozen=True, slots=True)
class TimedMessage(Generic[T]):
    """A message and its time [s]."""

    time_s: float
    message: T


@dataclass(frozen=True, slots=True)
class ProcessTrack:
    """Statuses of one process: time (n), cpu share (n), pid, ticks, overruns, overflowed (n each).

    waited: share of the time for which it had no core (n); others_cpu: cores that other programs used (n), nan where
    it is not reported.
    """

    time_s: Array
    cpu: Array
    counters: Array
    waited: Array
    others_cpu: Array


_ANYWHERE = (-1e9, 1e9)
UNKNOWN_FIELD = ResolvedField(
    site="",
    room=Room(size_m=(8.0, 6.0, 4.0), fence=Fence(x_m=_ANYWHERE, y_m=_ANYWHERE, z_m=_ANYWHERE)),
    cameras={},
    drones={},
    target=SingleTarget(name="turtlebot", marker=TargetMarker()),
    planner=PlannerValues(level_heights_m=()),
    safety=SafetyValues(min_separation_m=0.0),
)
"""Stands in for the field of a recording that has none that can be read."""


@dataclass(slots=True)
class RunData:
    """The input of the report. `start_unix_ns` is the time of the first message, `end_s` of the last.

    belief: the last one. suspicions: at least one for each verdict of the diagnosis. rerun, stretch: what
    it repeats or is a part of, if it is no whole flight. heard_s: times of each vehicle's telemetry. recorded_s: the
    tenths of a second in which any message is recorded, in order; none: unknown.
    """

    resolved: ResolvedField
    facts: RunFacts
    start_unix_ns: int = 0
    end_s: float = 0.0
    truth: dict[str, TruthTrack] = field(default_factory=dict)
    estimates: dict[str, EstimateTrack] = field(default_factory=dict)
    certainties: dict[str, CertaintyTrack] = field(default_factory=dict)
    processes: dict[str, ProcessTrack] = field(default_factory=dict)
    sim_counters: Array | None = None
    commands: list[TimedMessage[Command]] = field(default_factory=list)
    acks: list[TimedMessage[CommandAck]] = field(default_factory=list)
    plans: list[TimedMessage[Plan]] = field(default_factory=list)
    innovations: list[TimedMessage[Innovation]] = field(default_factory=list)
    belief: Belief | None = None
    events: list[TimedMessage[Event]] = field(default_factory=list)
    vehicles: dict[str, list[TimedMessage[VehicleStatus]]] = field(default_factory=dict)
    heard_s: dict[str, Array] = field(default_factory=dict)
    recorded_s: Array = field(default_factory=lambda: np.empty(0))
    search_maps: dict[str, list[TimedMessage[SearchMap]]] = field(default_factory=dict)
    suspicions: list[TimedMessage[Suspicion]] = field(default_factory=list)
    damage: list[str] = field(default_factory=list)
    rerun: Rerun | None = None
    stretch: Stretch | None = None

    @property
    def breaks_off(self) -> bool:
        """Return whether the recording is damaged and lacks the end of the run: a full disk, or a recorder's death."""
        return bool(self.damage) and not any(one.message.ends_run for one in self.events)

    @property
    def drones(self) -> tuple[str, ...]:
        """Return the names of all drones of the field."""
        return tuple(self.resolved.drones)

    @property
    def tracked(self) -> tuple[str, ...]:
        """Return the names of the targets."""
        return tuple(self.resolved.tracked)

    @property
    def heights_m(self) -> tuple[float, ...]:
        """Return the distinct heights of levels that this team can use, lowest first."""
        rows = self.resolved.planner.level_heights_m[: len(self.drones)]
        return tuple(sorted({height for row in rows for height in row}))
