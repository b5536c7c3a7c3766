"""What the operator must not overlook, from the state; pure."""

from collections.abc import Iterator
from dataclasses import dataclass

from groundstation.bus.messages import FlightState, Lifecycle, Severity
from groundstation.monitor.state import MonitorState

VEHICLE_SILENT_S = 1.0
ESTIMATE_SILENT_S = 0.3
PROCESS_SILENT_S = 3.0
CAMERA_SILENT_S = 2.0
TARGET_LOST_S = 3.0
_EVENT_SHOWN_S = 8.0


@dataclass(frozen=True, slots=True)
class Alarm:
    """One line; `grave` ones are red, the others yellow."""

    text: str
    grave: bool = True


def alarms_of(state: MonitorState, now_ns: int) -> list[Alarm]:
    """Return all alarms, grave ones first."""
    alarms = [
        *_vehicles(state, now_ns),
        *_tracker(state, now_ns),
        *_cameras(state, now_ns),
        *_processes(state, now_ns),
        *_events(state, now_ns),
    ]
    return sorted(dict.fromkeys(alarms), key=lambda alarm: not alarm.grave)


def _vehicles(state: MonitorState, now_ns: int) -> Iterator[Alarm]:
    for name, seen in state.vehicles.items():
        age, status = seen.age_s(now_ns), seen.message
        if age > VEHICLE_SILENT_S:
            yield Alarm(f"{name}: nothing heard for {age:.0f} s")
        if status.flight_state in (FlightState.EMERGENCY, FlightState.LOST):
            yield Alarm(f"{name}: {status.flight_state}")
        limit = state.cast.drones.get(name, 0.15)
        if status.battery is not None and status.battery < limit + 0.05:
            yield Alarm(f"{name}: battery {status.battery:.0%} (lands at {limit:.0%})", status.battery < limit)


def _tracker(state: MonitorState, now_ns: int) -> Iterator[Alarm]:
    if state.estimate is None:
        return
    age = state.estimate.age_s(now_ns)
    if age > ESTIMATE_SILENT_S:
        yield Alarm(f"tracker: no estimate for {age:.1f} s")
    for target in map(state.entity, state.cast.targets):
        if target is not None and target.age_s > TARGET_LOST_S:
            yield Alarm(f"{target.name}: not seen for {target.age_s:.0f} s", False)


def _cameras(state: MonitorState, now_ns: int) -> Iterator[Alarm]:
    for name, seen in state.cameras.items():
        if not seen.message.connected or seen.age_s(now_ns) > CAMERA_SILENT_S:
            yield Alarm(f"{name}: no pictures{f' ({seen.message.detail})' if seen.message.detail else ''}", False)


def _processes(state: MonitorState, now_ns: int) -> Iterator[Alarm]:
    for name, seen in state.processes.items():
        status = seen.message
        if seen.age_s(now_ns) > PROCESS_SILENT_S and status.state is not Lifecycle.STOPPING:
            yield Alarm(f"process {name}: silent for {seen.age_s(now_ns):.0f} s")
        elif status.state is Lifecycle.DEGRADED:
            yield Alarm(f"process {name}: {status.detail or 'degraded'}", False)


def _events(state: MonitorState, now_ns: int) -> Iterator[Alarm]:
    for seen in state.events:
        if seen.message.severity is Severity.ERROR and seen.age_s(now_ns) < _EVENT_SHOWN_S:
            yield Alarm(seen.message.sentence)
