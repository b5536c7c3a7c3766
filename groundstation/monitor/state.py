"""What an observer of the bus remembers: the newest of everything, and when it was."""

from collections import deque
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any, Generic, TypeVar

import msgspec

from groundstation.bus import messages as m
from groundstation.bus.api import Received

_EVENTS = 50
_COMMANDS = 8
T = TypeVar("T")


class _Limits(msgspec.Struct, frozen=True):
    battery_min: float = 0.15


class _Drone(msgspec.Struct, frozen=True):
    limits: _Limits = _Limits()


class _Target(msgspec.Struct, frozen=True):
    name: str = ""


class _Field(msgspec.Struct, frozen=True):
    site: str = ""
    drones: dict[str, _Drone] = {}
    cameras: dict[str, msgspec.Raw] = {}
    target: _Target | None = _Target()
    targets: dict[str, msgspec.Raw] = {}


@dataclass(frozen=True, slots=True)
class Cast:
    """Who should be there: drones with their battery limit, targets, world-fixed cameras."""

    site: str = ""
    drones: dict[str, float] = field(default_factory=dict)
    targets: tuple[str, ...] = ()
    cameras: tuple[str, ...] = ()


def cast_from_field(data: bytes) -> Cast:
    """Return the cast of a resolved field's JSON."""
    resolved = msgspec.json.decode(data, type=_Field)
    drones = {name: drone.limits.battery_min for name, drone in resolved.drones.items()}
    single = (resolved.target.name,) if resolved.target and resolved.target.name else ()
    return Cast(resolved.site, drones, tuple(resolved.targets) or single, tuple(resolved.cameras))


@dataclass(frozen=True, slots=True)
class Seen(Generic[T]):
    """A message and its stamp on this host's boot clock [ns]."""

    stamp_ns: int
    message: T

    def age_s(self, now_ns: int) -> float:
        """Return how old it is [s]."""
        return max(0.0, (now_ns - self.stamp_ns) / 1e9)


@dataclass(slots=True)
class MonitorState:
    """The newest message of each kind and entity; `hint` is what Ctrl-C does here."""

    cast: Cast = field(default_factory=Cast)
    hint: str = ""
    started_ns: int = 0
    vehicles: dict[str, Seen[m.VehicleStatus]] = field(default_factory=dict)
    cameras: dict[str, Seen[m.CameraStatus]] = field(default_factory=dict)
    processes: dict[str, Seen[m.ProcessStatus]] = field(default_factory=dict)
    sightings: dict[tuple[str, str], int] = field(default_factory=dict)
    events: deque[Seen[m.Event]] = field(default_factory=lambda: deque(maxlen=_EVENTS))
    estimate: Seen[m.Estimate] | None = None
    plan: Seen[m.Plan] | None = None
    lease: Seen[m.Lease] | None = None
    sim: Seen[m.SimStatus] | None = None
    command: Seen[m.Command] | None = None
    answers: dict[str, dict[str, m.CommandAck]] = field(default_factory=dict)

    def ingest(self, received: Iterable[Received]) -> None:
        """Remember messages; unknown types are passed over."""
        for item in received:
            if item.message is not None:
                self._take(item.header.entity, item.header.stamp_ns, item.message)

    def entity(self, name: str) -> m.EntityEstimate | None:
        """Return what is believed of an entity."""
        entities = self.estimate.message.entities if self.estimate else ()
        return next((entity for entity in entities if entity.name == name), None)

    def as_json(self, now_ns: int) -> bytes:
        """Return the newest messages by kind and entity, each with its age."""

        def by_name(group: Mapping[str, Seen[Any]]) -> dict[str, Any]:
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
                self.vehicles[entity] = Seen(stamp_ns, message)
            case m.CameraStatus():
                self.cameras[entity] = Seen(stamp_ns, message)
            case m.ProcessStatus():
                self.processes[entity] = Seen(stamp_ns, message)
            case m.RelativeObservation():
                self.sightings[message.observer, message.subject] = stamp_ns
            case m.Event():
                self.events.append(Seen(stamp_ns, message))
            case m.Estimate():
                self.estimate = Seen(stamp_ns, message)
            case m.Plan():
                self.plan = Seen(stamp_ns, message)
            case m.Lease():
                self.lease = Seen(stamp_ns, message)
            case m.SimStatus():
                self.sim = Seen(stamp_ns, message)
            case m.Command():
                self.command = Seen(stamp_ns, message)
            case m.CommandAck():
                # An answer may overtake its command: they come from different senders.
                self.answers.setdefault(message.command_id, {})[entity] = message
                while len(self.answers) > _COMMANDS:
                    del self.answers[next(iter(self.answers))]
