"""Times the product's path of an observation as in flight: bytes, codec, intake, filter, `Innovation`, bytes.

A second of a flying team is generated beforehand as payloads with their times of arrival.
"""

import math
import time
from collections.abc import Iterator
from typing import Any

import numpy as np

from groundstation.bench.estimator_team import CAMERA_HZ, ODOMETRY_HZ, BenchTeam, sighting
from groundstation.bus import codec, keys
from groundstation.bus.memory_bus import MemoryBus, MemoryExchange
from groundstation.bus.messages import (
    FlightState,
    Header,
    Message,
    Odometry,
    RelativeObservation,
    VehicleStatus,
)
from groundstation.bus.topics import OBSERVATION, ODOMETRY, VEHICLE_STATUS, Topic
from groundstation.estimation.fixed_lag import FixedLagFilter
from groundstation.estimation.ingest import Intake
from groundstation.runtime.announcer import Announcer

MS = 1_000_000
TICK_MS = 20  # the tracker's
JOIN_MS = 400  # flown before the clock runs: all have joined then
_START_NS = 10**12
_CLOCK, _SITE = "bench", "lab"
_DETECTION_LATE_MS = 4  # delay of wire and decoder

Arrival = tuple[int, keys.Key, str, bytes]


def flight(team: BenchTeam, duration_ms: int, late_ms: int, heights: bool, rng: np.random.Generator) -> list[Arrival]:
    """Return a flight's arrivals as (time, key, its text, payload), in order; cameras have phases of their own.

    late_ms: delay of observations, odometry has none; heights: whether odometry carries heights.
    """
    end_ns = _START_NS + (JOIN_MS + duration_ms) * MS
    found = [_packed(_START_NS, VEHICLE_STATUS, _status(name, 0), 0) for name in team.robots]
    for name in team.robots:
        phase_ns = int(rng.integers(0, 5 * MS))
        for seq, stamp_ns in enumerate(range(_START_NS + phase_ns, end_ns, 1000 * MS // ODOMETRY_HZ)):
            found.append(_packed(stamp_ns, ODOMETRY, _odometry(team, name, stamp_ns, seq, heights, rng), 2))
    late = late_ms or _DETECTION_LATE_MS
    for observer in team.parameters.sensors:
        subjects = [edge for edge in team.edges if edge[0] == observer]
        phase_ns = int(rng.integers(0, 33 * MS))
        for seq, stamp_ns in enumerate(range(_START_NS + phase_ns, end_ns - late * MS, 1000 * MS // CAMERA_HZ)):
            for place, edge in enumerate(subjects):
                message = _observation(team, edge, stamp_ns, seq * len(subjects) + place, rng)
                found.append(_packed(stamp_ns, OBSERVATION, message, late))
    return sorted(found, key=lambda arrival: arrival[0])


def _packed(stamp_ns: int, topic: Topic, message: Message, late_ms: int) -> Arrival:
    key = keys.Key(_SITE, message.header.entity, topic, message.header.source)
    return stamp_ns + late_ms * MS, key, str(key), codec.encode(message)


def _header(name: str, stamp_ns: int, seq: int) -> Header:
    return Header(stamp_ns, _CLOCK, name, "driver", seq)


def _status(name: str, seq: int) -> VehicleStatus:
    return VehicleStatus(header=_header(name, _START_NS, seq), flight_state=FlightState.FLYING, mode="flying")


def _odometry(team: BenchTeam, name: str, stamp_ns: int, seq: int, heights: bool, rng: np.random.Generator) -> Odometry:
    place = team.truth[team.tables.part(team.index(name))]
    noise = rng.normal(size=4)
    return Odometry(
        header=_header(name, stamp_ns, seq),
        velocity_m_s=(0.02 * float(noise[0]), 0.02 * float(noise[1]), 0.0),
        velocity_covariance=(4e-4, 0.0, 0.0, 0.0, 4e-4, 0.0, 0.0, 0.0, 4e-4),
        yaw_rad=float(place[3] + 1e-4 * noise[2]),
        roll_rad=0.0,
        pitch_rad=0.0,
        height_m=float(place[2] + 0.02 * noise[3]) if heights else None,
    )


def _observation(
    team: BenchTeam, edge: tuple[str, str], stamp_ns: int, seq: int, rng: np.random.Generator
) -> RelativeObservation:
    m = sighting(team, edge, stamp_ns, rng)
    return RelativeObservation(
        header=_header(edge[0], stamp_ns, seq),
        observer=edge[0],
        subject=edge[1],
        camera=edge[0],
        position_m=m.position_m,
        yaw_rad=m.yaw_rad,
        covariance=m.covariance,
        margin=3.0,
    )


class _Kept(MemoryBus):
    """A bus that keeps published messages."""

    def __init__(self) -> None:
        super().__init__(MemoryExchange(), _SITE, "tracker")
        self.payloads: list[bytes] = []

    def put(self, topic: Topic, entity: str, payload: bytes, attachment: bytes) -> None:
        self.payloads.append(payload)


class Path:
    """The tracker's part from payloads to payloads, without planning."""

    def __init__(self, team: BenchTeam) -> None:
        self.filter = FixedLagFilter(team.parameters)
        self._intake = Intake(self.filter, team.parameters.sensors, _CLOCK)
        self._bus = _Kept()
        self._announcer = Announcer(self._bus, lifetime_ms=0)

    @property
    def innovations(self) -> list[bytes]:
        """Return the last tick's verdict on each observation."""
        return self._bus.payloads

    def tick(self, arrived: list[Arrival], now_ns: int) -> None:
        """Take the arrivals, advance, and publish the verdict on each observation."""
        self._bus.payloads = []
        for _, key, text, payload in arrived:
            self._intake.take(text, codec.decode(key, payload), now_ns)
        self.filter.advance(now_ns)
        self._announcer.innovations(self.filter.take_corrections(), now_ns)


def fly(team: BenchTeam, duration_ms: int, late_ms: int, heights: bool, seed: int) -> dict[str, Any]:
    """Return CPU time per observation [us], odometry and all else included, and counts of the run."""
    path, explained, before = Path(team), 0, time.process_time()
    for now_ns, arrived in ticks(flight(team, duration_ms, late_ms, heights, np.random.default_rng(seed))):
        if now_ns <= _START_NS + (JOIN_MS + late_ms) * MS:
            path.tick(arrived, now_ns)
            before = time.process_time()
            continue
        path.tick(arrived, now_ns)
        explained += len(path.innovations)
    spent = time.process_time() - before
    return {
        "us_per_observation": 1e6 * spent / explained,
        "observations": explained,
        "joined": len(path.filter.belief().layout.blocks),
        "entities": len(team.parameters.entities),
        "delay_ms": late_ms,
        "heights": heights,
        "waits_ms": round(1e3 * team.parameters.wait_s, 1),
        "error_m": _worst_error(team, path.filter),
    }


def _worst_error(team: BenchTeam, joint: FixedLagFilter) -> float:
    belief = joint.belief()
    places = [(belief.mean_of(name)[:2], team.truth[team.tables.part(team.index(name))][:2]) for name in team.robots]
    return max((math.dist(a, b) for a, b in places), default=math.nan)


def ticks(arrivals: list[Arrival]) -> Iterator[tuple[int, list[Arrival]]]:
    """Return (now, arrivals since the last tick) for each tick of the tracker."""
    now_ns, first = _START_NS, 0
    while first < len(arrivals):
        now_ns += TICK_MS * MS
        last = first
        while last < len(arrivals) and arrivals[last][0] <= now_ns:
            last += 1
        yield now_ns, arrivals[first:last]
        first = last
