"""Collects from the bus the input of the preflight checks, and answers whether a take-off is permitted."""

from collections.abc import Collection, Mapping, Sequence
from typing import TypeVar

from groundstation.bus.api import Bus
from groundstation.bus.messages import (
    AIRBORNE,
    CameraStatus,
    Event,
    Preflight,
    PreflightFinding,
    RangeObservation,
    RelativeObservation,
    Severity,
    VehicleStatus,
)
from groundstation.bus.topics import CAMERA_STATUS, EVENT, OBSERVATION, PREFLIGHT, RANGE, VEHICLE_STATUS
from groundstation.doctor.finding import Finding, Level
from groundstation.field.resolved import ResolvedField
from groundstation.preflight.expected import all_shown
from groundstation.preflight.health import left_out
from groundstation.preflight.judge import judge, open_musts
from groundstation.preflight.pad_record import PadRecord
from groundstation.runtime.asking import TEAM
from groundstation.time_units import NS_PER_S

_AGAIN_NS = 3 * NS_PER_S
# Drivers report at least twice a second: older reports do not describe the present.
_SPOKEN_NS = 3 * NS_PER_S
_SEVERITIES = {Level.MUST: Severity.ERROR, Level.SHOULD: Severity.WARNING}

_Status = TypeVar("_Status", VehicleStatus, CameraStatus)


class BeforeTakeOff:
    """Call `update` often; `findings` takes up to a tenth of a second with a team of eight.

    Once `publish` has sent the list, `update` sends it again every 3 s while nobody flies. A drone that has flown in
    this run may stand anywhere: it must be seen, but is no longer compared with its pad. cautions: warnings about the
    field file.
    """

    def __init__(self, bus: Bus, field: ResolvedField, cautions: Sequence[Finding] = ()) -> None:
        self._bus, self._field, self._cautions = bus, field, cautions
        self._inbox = bus.subscribe([OBSERVATION, RANGE, VEHICLE_STATUS, CAMERA_STATUS])
        self._vehicles: dict[str, tuple[int, VehicleStatus]] = {}
        self._cameras: dict[str, tuple[int, CameraStatus]] = {}
        self._flew: set[str] = set()
        self._aloft: set[str] = set()
        self._record = PadRecord(field.world_sensors)
        self._next_ns: int | None = None

    def update(self, now_ns: int) -> None:
        """Take the messages that have arrived."""
        for received in self._inbox.drain():
            match received.message:
                case RelativeObservation() | RangeObservation() as sighting if sighting.subject not in self._aloft:
                    self._record.see(sighting, now_ns)
                case CameraStatus() as status:
                    self._cameras[status.header.entity] = now_ns, status
                case VehicleStatus() as status:
                    self._hear(status, now_ns)
        if self._next_ns is not None and now_ns >= self._next_ns and not self._aloft:
            self._tell(self.findings(now_ns), now_ns)

    def _hear(self, status: VehicleStatus, now_ns: int) -> None:
        name = status.header.entity
        self._vehicles[name] = now_ns, status
        if status.flight_state in AIRBORNE:
            self._flew.add(name)
            self._aloft.add(name)
            self._record.forget(name)
        else:
            self._aloft.discard(name)

    def complete(self, now_ns: int) -> bool:
        """Return whether every sensor has reported, and fixed ones have shown often enough what they should.

        A target's odometry is awaited until it flows or its driver says what it lacks.
        """
        if not set(self._field.world_sensors) <= self._cameras.keys():
            return False
        told = {name for name, (_, status) in self._cameras.items() if status.connected or status.detail}
        if not set(self._field.reporting) <= told:
            return False
        shown = {(sighting.camera, sighting.drone) for sighting in self._record.medians(now_ns)}
        return all_shown(self._field, shown, self._flew)

    def findings(self, now_ns: int) -> list[Finding]:
        """Return all present findings, the grave first."""
        vehicles, cameras = _spoken(self._vehicles, now_ns), _spoken(self._cameras, now_ns)
        medians = self._record.medians(now_ns)
        return judge(self._field, vehicles, cameras, medians, self._flew, self._cautions, self._aloft)

    def left_out(self, now_ns: int) -> tuple[str, ...]:
        """Return the drones that a take-off of all would leave on the ground now."""
        return left_out(self._field, _spoken(self._vehicles, now_ns))

    def forbids(self, now_ns: int, drones: Collection[str]) -> list[Finding]:
        """Return the findings that forbid a take-off of the given drones (none: all)."""
        return open_musts(self.findings(now_ns), drones, self._field.drones)

    def publish(self, findings: Collection[Finding], now_ns: int) -> None:
        """Send all findings to the console and the recording, and those that are not OK as events too."""
        self._tell(findings, now_ns)
        for one in findings:
            if one.level in _SEVERITIES:
                entity = one.subject if one.subject in self._field.drones else TEAM
                text = f"before take-off: {one.subject}: {one.found}"
                header = self._bus.header(entity)
                event = Event(header=header, severity=_SEVERITIES[one.level], text=text, remedy=one.remedy)
                self._bus.publish(EVENT, event)

    def _tell(self, findings: Collection[Finding], now_ns: int) -> None:
        self._next_ns = now_ns + _AGAIN_NS
        rows = tuple(PreflightFinding(one.level, one.subject, one.found, one.remedy) for one in findings)
        self._bus.publish(PREFLIGHT, Preflight(header=self._bus.header(TEAM), findings=rows))

    def record_override(self, who: str, findings: Collection[Finding]) -> None:
        """Report, and record, that somebody takes off although the checks forbid it."""
        what = "; ".join(f"{one.subject}: {one.found}" for one in findings)
        text = f"{who} takes off although it must not: {what}"
        event = Event(header=self._bus.header(TEAM), severity=Severity.WARNING, text=text, remedy="land")
        self._bus.publish(EVENT, event)


def _spoken(heard: Mapping[str, tuple[int, _Status]], now_ns: int) -> dict[str, _Status]:
    """Return the recent reports: the last report of a dead driver no longer counts."""
    return {name: status for name, (at_ns, status) in heard.items() if now_ns - at_ns < _SPOKEN_NS}
