"""State of each drone for the operator: its own reports, and the height at which fixed sensors see it."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum

from groundstation.bus.api import Bus
from groundstation.bus.messages import (
    STANDING,
    UNHEARD,
    UP,
    FlightState,
    Odometry,
    RangeObservation,
    RelativeObservation,
    Vector3,
    VehicleStatus,
    flies,
    known_state,
    stood_last,
)
from groundstation.bus.topics import OBSERVATION, ODOMETRY, RANGE, VEHICLE_STATUS
from groundstation.runtime.marker_height import FixedCamera, MarkerHeight
from groundstation.time_units import NS_PER_MS

_FRESH_NS = 1_500 * NS_PER_MS
# For a standing drone whose marker no camera saw.
_STANDING_M = 0.1


class TeamPhase(StrEnum):
    """The phase that the team is ordered into."""

    GROUND = "GROUND"
    TAKING_OFF = "TAKING_OFF"
    UP = "UP"
    TRACKING = "TRACKING"
    HELD = "HELD"
    LANDING = "LANDING"


@dataclass(slots=True)
class Member:
    """One drone; times are when this process learned of a thing [ns], 0 = never.

    marker: its height above the floor; floor_m: the same, before the latest take-off in the team began; height_m: above
    the ground, as the drone itself measured it, or None.
    """

    state: FlightState = FlightState.UNKNOWN
    mode: str = ""
    detail: str = ""
    heard_ns: int = 0
    marker: MarkerHeight = field(default_factory=MarkerHeight)
    floor_m: float = _STANDING_M
    height_m: float | None = None
    measured_ns: int = 0

    def connected(self, now_ns: int) -> bool:
        """Return whether its driver reports, and receives telemetry."""
        return self.fresh(now_ns) and self.state not in UNHEARD

    def fresh(self, now_ns: int) -> bool:
        """Return whether its driver reported lately."""
        return self.heard_ns > 0 and now_ns - self.heard_ns < _FRESH_NS

    @property
    def up(self) -> bool:
        """Return whether it flies, its take-off finished."""
        return self.state in UP

    @property
    def flies(self) -> bool:
        """Return whether it flies, or did when it was heard last, and does not land."""
        lands = FlightState.LANDING in (self.state, self.mode)
        return flies(self.state, self.mode) is True and not lands

    @property
    def on_ground(self) -> bool:
        """Return whether it reports that it stands with motors off."""
        return self.state in STANDING

    @property
    def stood(self) -> bool:
        """Return whether it is silent, and stood until then."""
        return stood_last(self.state, self.mode)

    @property
    def standing(self) -> bool:
        """Return whether it reports that it stands, or has never reported."""
        return self.on_ground or self.state is FlightState.UNKNOWN

    @property
    def lifting(self) -> bool:
        """Return whether it takes off or flies."""
        return self.up or self.state is FlightState.TAKING_OFF

    def reported_m(self, now_ns: int) -> float | None:
        """Return the height above the ground that the drone itself measures now [m]."""
        return self.height_m if now_ns - self.measured_ns < _FRESH_NS else None

    def rise_m(self, now_ns: int) -> float | None:
        """Return the rise of its marker since the take-off began [m], or None if it is out of view."""
        marker_m = self.marker.at(now_ns)
        return None if marker_m is None else marker_m - self.floor_m

    def note_floor(self, now_ns: int) -> None:
        """Measure rises from the present height of a standing drone's marker."""
        marker_m = self.marker.at(now_ns)
        if self.standing and marker_m is not None:
            self.floor_m = marker_m


class TeamStatus:
    """All drones of a run, kept up to date from the bus; cameras: those fixed in the world, by name."""

    def __init__(self, bus: Bus, drones: tuple[str, ...], cameras: Mapping[str, FixedCamera]) -> None:
        self.members = {name: Member() for name in drones}
        self._cameras = cameras
        self._events = bus.subscribe([VEHICLE_STATUS, OBSERVATION, RANGE])
        self._odometry = bus.subscribe([ODOMETRY], newest=True)

    def update(self, now_ns: int) -> None:
        """Take the messages that have arrived."""
        for received in (*self._events.drain(), *self._odometry.drain()):
            match received.message:
                case VehicleStatus() as status:
                    self._hear(status, now_ns)
                case RelativeObservation() as sighting:
                    self._see(sighting.observer, sighting.subject, sighting.position_m, now_ns)
                case RangeObservation(position_m=(_, _, _) as place) as told:
                    self._see(told.observer, told.subject, place, now_ns)
                case Odometry() as odometry:
                    self._measure(odometry, now_ns)

    def _hear(self, status: VehicleStatus, now_ns: int) -> None:
        member = self.members.get(status.header.entity)
        if member is not None:
            if not member.standing and status.flight_state in STANDING:
                member.marker.forget()  # its sightings until now were in the air
            before = FlightState.LANDED if member.stood else member.state
            member.state = known_state(before, status.flight_state)
            member.mode, member.detail = status.mode, status.detail
            member.heard_ns = now_ns

    def _see(self, observer: str, subject: str, position_m: Vector3, now_ns: int) -> None:
        # Only fixed cameras know their own height independently of the drones' faults.
        camera, member = self._cameras.get(observer), self.members.get(subject)
        if camera is not None and member is not None:
            member.marker.see(now_ns, camera.height_of(position_m))

    def _measure(self, odometry: Odometry, now_ns: int) -> None:
        member = self.members.get(odometry.header.entity)
        if member is not None:
            member.height_m, member.measured_ns = odometry.height_m, now_ns

    def note_floor(self, now_ns: int) -> None:
        """Measure rises from the present heights of all standing drones' markers."""
        for member in self.members.values():
            member.note_floor(now_ns)

    @property
    def up(self) -> tuple[str, ...]:
        """Return the drones that fly, their take-off finished."""
        return tuple(name for name, member in self.members.items() if member.up)

    @property
    def flying(self) -> tuple[str, ...]:
        """Return the drones that a take-off leaves alone: they fly, or did when they were heard last."""
        return tuple(name for name, member in self.members.items() if member.flies)

    def airborne(self, now_ns: int) -> tuple[str, ...]:
        """Return the drones not known to stand: a drone that connected once and then was lost counts as flying.

        Except one that last stood, without an order to take off: its battery is empty.
        """
        return tuple(name for name, member in self.members.items() if member.heard_ns and not _at_rest(member, now_ns))


def _at_rest(member: Member, now_ns: int) -> bool:
    never_met = member.state is FlightState.UNKNOWN
    return never_met or ((member.on_ground or member.stood) and member.fresh(now_ns))
