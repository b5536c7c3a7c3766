"""The state that an observer of the bus keeps: the newest message of each kind, and its time."""

import math
from collections import deque
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any, Generic, TypeVar

import msgspec

from groundstation.bus import messages as m
from groundstation.bus.api import Received
from groundstation.field.resolved import ResolvedField
from groundstation.monitor.endurance import TakeOff, take_off_of
from groundstation.time_units import NS_PER_S
from groundstation.vehicles import kind_named

_EVENTS = 50
_COMMANDS = 8
_AHEAD_NS = NS_PER_S
T = TypeVar("T")


@dataclass(frozen=True, slots=True)
class Cast:
    """The expected entities: drones with their battery limit, targets, world-fixed cameras.

    flight_times_s: usual flight time of a drone with a full battery, where its kind states one. lost_after_s: time
    unseen after which a robot or target is lost. unseen_land_s: time unseen after which a robot lands at the latest.
    min_separation_m: the least distance of flying drones. room_m: length and width of the room.
    """

    site: str = ""
    drones: dict[str, float] = field(default_factory=dict)
    targets: tuple[str, ...] = ()
    cameras: tuple[str, ...] = ()
    flight_times_s: dict[str, float] = field(default_factory=dict)
    lost_after_s: float = 3.0
    unseen_land_s: float = 30.0
    min_separation_m: float = 0.6
    room_m: tuple[float, float] = (math.inf, math.inf)


def cast_from_field(resolved: ResolvedField) -> Cast:
    """Return the cast of a resolved field."""
    drones = {name: drone.limits.battery_min for name, drone in resolved.drones.items()}
    usual = {name: kind_named(drone.kind).flight_time_s for name, drone in resolved.drones.items()}
    flight_times_s = {name: time_s for name, time_s in usual.items() if time_s is not None}
    lost_after_s = resolved.estimator.lost_after_s
    targets, cameras, safety = tuple(resolved.tracked), tuple(resolved.cameras), resolved.safety
    limits, room_m = (safety.unseen_land_at_last_s, safety.min_separation_m), resolved.room.size_m[:2]
    return Cast(resolved.site, drones, targets, cameras, flight_times_s, lost_after_s, *limits, room_m)


def heard_ns(item: Received) -> int:
    """Return the time from which a message counts: that of its stamp, or of its arrival if the stamp lies ahead.

    Else one from a clock that is ahead would look new for as long as that, however silent its sender is.
    """
    return min(item.header.stamp_ns, item.arrived_ns or item.header.stamp_ns)


@dataclass(frozen=True, slots=True)
class StampedMessage(Generic[T]):
    """A message and the time from which it counts, on this host's boot clock [ns]."""

    stamp_ns: int
    message: T

    def age_s(self, now_ns: int) -> float:
        """Return how old it is [s]."""
        return max(0.0, (now_ns - self.stamp_ns) / 1e9)


@dataclass(slots=True)
class MonitorState:
    """The newest message of each kind and entity; `hint` states the effect of Ctrl-C here.

    climbed_ns: stamp of the first status of each flying drone since its climb, or since one listens. flown: whether one
    has flown since then. ahead: senders whose stamps lie ahead [s], with the newest arrival of such a message.
    """

    cast: Cast = field(default_factory=Cast)
    hint: str = ""
    started_ns: int = 0
    vehicles: dict[str, StampedMessage[m.VehicleStatus]] = field(default_factory=dict)
    take_offs: dict[str, TakeOff | None] = field(default_factory=dict)
    climbed_ns: dict[str, int] = field(default_factory=dict)
    cameras: dict[str, StampedMessage[m.CameraStatus]] = field(default_factory=dict)
    processes: dict[str, StampedMessage[m.ProcessStatus]] = field(default_factory=dict)
    sightings: dict[tuple[str, str], int] = field(default_factory=dict)
    events: deque[StampedMessage[m.Event]] = field(default_factory=lambda: deque(maxlen=_EVENTS))
    ahead: dict[str, StampedMessage[float]] = field(default_factory=dict)
    estimate: StampedMessage[m.Estimate] | None = None
    plan: StampedMessage[m.Plan] | None = None
    suspicion: m.Suspicion | None = None
    preflight: StampedMessage[m.Preflight] | None = None
    flown: bool = False
    lease: StampedMessage[m.Lease] | None = None
    sim: StampedMessage[m.SimStatus] | None = None
    command: StampedMessage[m.Command] | None = None
    answers: dict[str, dict[str, m.CommandAck]] = field(default_factory=dict)

    def ingest(self, received: Iterable[Received]) -> None:
        """Remember messages; unknown types are ignored."""
        for item in received:
            if item.message is not None:
                if item.header.stamp_ns - (at_ns := heard_ns(item)) > _AHEAD_NS:
                    ahead_s = (item.header.stamp_ns - at_ns) / NS_PER_S
                    self.ahead[item.header.source] = StampedMessage(at_ns, ahead_s)
                self._take(item.header.entity, at_ns, item.message)

    def entity(self, name: str) -> m.EntityEstimate | None:
        """Return the estimate of an entity, or None."""
        entities = self.estimate.message.entities if self.estimate else ()
        return next((entity for entity in entities if entity.name == name), None)

    def as_json(self, now_ns: int) -> bytes:
        """Return the newest messages by kind and entity, each with its age."""

        def by_name(group: Mapping[str, StampedMessage[Any]]) -> dict[str, Any]:
            return {name: {"age_s": seen.age_s(now_ns), "message": seen.message} for name, seen in group.items()}

        single = {"estimate": self.estimate, "plan": self.plan, "lease": self.lease, "sim": self.sim}
        content = {
            "vehicles": by_name(self.vehicles),
            "cameras": by_name(self.cameras),
            "processes": by_name(self.processes),
            "events": [seen.message for seen in self.events],
            **by_name({name: seen for name, seen in single.items() if seen is not None}),
        }
        return msgspec.json.encode(content)

    def _take(self, entity: str, stamp_ns: int, message: m.Message) -> None:
        match message:
            case m.VehicleStatus():
                status = self._known(entity, message)
                self.vehicles[entity] = StampedMessage(stamp_ns, status)
                self.take_offs[entity] = take_off_of(self.take_offs.get(entity), stamp_ns, status)
                self._note_climb(entity, stamp_ns, status)
            case m.CameraStatus():
                self.cameras[entity] = StampedMessage(stamp_ns, message)
            case m.ProcessStatus():
                self.processes[entity] = StampedMessage(stamp_ns, message)
            case m.RelativeObservation():
                self.sightings[message.observer, message.subject] = stamp_ns
            case m.Event():
                self.events.append(StampedMessage(stamp_ns, message))
            case m.Estimate():
                self.estimate = StampedMessage(stamp_ns, message)
            case m.Plan():
                self.plan = StampedMessage(stamp_ns, message)
            case m.Suspicion():
                self.suspicion = message
            case m.Preflight():
                self.preflight = StampedMessage(stamp_ns, message)
            case m.Lease():
                self.lease = StampedMessage(stamp_ns, message)
            case m.SimStatus():
                self.sim = StampedMessage(stamp_ns, message)
            case m.Command():
                self.command = StampedMessage(stamp_ns, message)
            case m.CommandAck():
                # An answer may overtake its command: they come from different senders.
                self.answers.setdefault(message.command_id, {})[entity] = message
                while len(self.answers) > _COMMANDS:
                    del self.answers[next(iter(self.answers))]

    def _note_climb(self, name: str, stamp_ns: int, status: m.VehicleStatus) -> None:
        self.flown |= status.flight_state in m.AIRBORNE
        if status.flight_state not in m.AIRBORNE or status.flight_state is m.FlightState.TAKING_OFF:
            self.climbed_ns.pop(name, None)
        else:
            self.climbed_ns[name] = min(stamp_ns, self.climbed_ns.get(name, stamp_ns))

    def _known(self, name: str, said: m.VehicleStatus) -> m.VehicleStatus:
        before = self.vehicles.get(name)
        if before is None:
            return said
        state = m.known_state(before.message.flight_state, said.flight_state)
        return said if state is said.flight_state else msgspec.structs.replace(said, flight_state=state)
