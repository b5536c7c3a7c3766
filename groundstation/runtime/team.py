"""What the operator knows of each drone: what it says of itself, and when a camera last saw it."""

from dataclasses import dataclass

from groundstation.bus.api import Bus
from groundstation.bus.messages import Estimate, FlightState, RelativeObservation, VehicleStatus
from groundstation.bus.topics import ESTIMATE, OBSERVATION, VEHICLE_STATUS

_FRESH_NS = 1_500_000_000
_ON_GROUND = frozenset({FlightState.LANDED, FlightState.EMERGENCY})
_UP = frozenset({FlightState.FLYING, FlightState.HOVERING})


@dataclass(slots=True)
class Member:
    """One drone; times are when this process learned of it [ns], 0 = never."""

    state: FlightState = FlightState.UNKNOWN
    mode: str = ""
    detail: str = ""
    heard_ns: int = 0
    seen_ns: int = 0
    up_since_ns: int = 0

    def connected(self, now_ns: int) -> bool:
        """Whether its driver speaks and hears the drone."""
        return self.fresh(now_ns) and self.state not in (FlightState.UNKNOWN, FlightState.LOST)

    def fresh(self, now_ns: int) -> bool:
        """Whether its driver spoke lately."""
        return self.heard_ns > 0 and now_ns - self.heard_ns < _FRESH_NS

    @property
    def up(self) -> bool:
        """Whether it flies, its take-off finished."""
        return self.state in _UP

    @property
    def on_ground(self) -> bool:
        """Whether it says that it stands, motors off."""
        return self.state in _ON_GROUND

    @property
    def seen_in_flight(self) -> bool:
        """Whether a camera saw it since it is up."""
        return self.up and self.seen_ns >= self.up_since_ns > 0


class Team:
    """All drones of a run, kept up to date from the bus."""

    def __init__(self, bus: Bus, drones: tuple[str, ...]) -> None:
        self.members = {name: Member() for name in drones}
        self._events = bus.subscribe([VEHICLE_STATUS, OBSERVATION])
        self._estimates = bus.subscribe([ESTIMATE], newest=True)

    def update(self, now_ns: int) -> None:
        """Take in what has arrived."""
        for received in (*self._events.drain(), *self._estimates.drain()):
            match received.message:
                case VehicleStatus() as status:
                    self._hear(status, now_ns)
                case RelativeObservation(subject=name):
                    self._see(name, now_ns)
                case Estimate(entities=entities):
                    for entity in entities:
                        self._see(entity.name, now_ns)

    def _hear(self, status: VehicleStatus, now_ns: int) -> None:
        member = self.members.get(status.header.entity)
        if member is None:
            return
        member.state, member.mode, member.detail = status.flight_state, status.mode, status.detail
        member.heard_ns = now_ns
        if not member.up:
            member.up_since_ns = 0
        elif not member.up_since_ns:
            member.up_since_ns = now_ns

    def _see(self, name: str, now_ns: int) -> None:
        if name in self.members:
            self.members[name].seen_ns = now_ns

    def airborne(self, now_ns: int) -> tuple[str, ...]:
        """Return who is not known to stand: a drone that was heard once and then lost counts as flying."""
        return tuple(name for name, member in self.members.items() if member.heard_ns and not _at_rest(member, now_ns))


def _at_rest(member: Member, now_ns: int) -> bool:
    never_met = member.state is FlightState.UNKNOWN
    return never_met or (member.on_ground and member.fresh(now_ns))
