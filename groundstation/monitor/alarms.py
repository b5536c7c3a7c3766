"""What the operator must not overlook, from the state; pure."""

from collections.abc import Iterator
from dataclasses import dataclass

from groundstation.bus.messages import FlightState, Lifecycle, Severity, VehicleStatus
from groundstation.monitor.state import MonitorState

VEHICLE_SILENT_S = 1.0
ESTIMATE_SILENT_S = 0.3
PROCESS_SILENT_S = 3.0
CAMERA_SILENT_S = 2.0
TARGET_LOST_S = 3.0
WEAK_LINK, BAD_LINK = 0.6, 0.3
_EVENT_SHOWN_S = 8.0
_DOWN = {
    FlightState.EMERGENCY: "To do: keep away until its motors stand, then level it on its pad.",
    FlightState.LOST: "To do: see to its battery and its link.",
}


@dataclass(frozen=True, slots=True)
class Alarm:
    """One line; `grave` ones are red, the others yellow.

    about: the same for as long as it is the same alarm, while figures in its text change.
    advice: whether an operator must do something, which it says first, and what happens next.
    """

    about: str
    text: str
    grave: bool = True
    advice: str = ""


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
        if seen.age_s(now_ns) > VEHICLE_SILENT_S:
            silence = f"{name}: nothing heard for {seen.age_s(now_ns):.0f} s"
            yield Alarm(f"{name} silent", silence, advice="Nothing to do: it hovers, then lands. Stops are sent to it.")
        else:
            yield from _failsafe(name, seen.message)
        if advice := _DOWN.get(seen.message.flight_state):
            state_words = f"{name}: {seen.message.flight_state}"
            yield Alarm(state_words, state_words, advice=advice)
        yield from _battery(name, seen.message, state.cast.drones.get(name, 0.15))
        yield from _link(name, seen.message.link_quality)


def _failsafe(name: str, status: VehicleStatus) -> Iterator[Alarm]:
    """What keeps a drone from its plan, or will land it."""
    if status.lands_in_s is not None:
        advice = "Nothing to do: it lands by itself unless this ends. HOLD does not stop that."
        yield Alarm(f"{name} lands", f"{name} lands in {status.lands_in_s:.0f} s: {status.detail}", advice=advice)
    elif status.braked:
        advice = "Nothing to do: it follows its plan again when this ends."
        yield Alarm(f"{name} braked", f"{name} {status.detail}", False, advice)


def _battery(name: str, status: VehicleStatus, limit: float) -> Iterator[Alarm]:
    about = f"{name} battery"
    if status.battery is None:
        if status.flight_state is not FlightState.UNKNOWN:
            yield Alarm(about, f"{name}: battery unknown", False, "To do: see why. Until then it may not take off.")
    elif status.battery < limit + 0.05 and status.flight_state is FlightState.LANDING:
        yield Alarm(about, f"{name}: battery {status.battery:.0%}, it lands", False, "Nothing to do.")
    elif status.battery < limit + 0.05:
        low = f"{name}: battery {status.battery:.0%} (lands at {limit:.0%})"
        yield Alarm(about, low, status.battery < limit, "To do: LAND it where it suits you; it lands by itself then.")


def _link(name: str, share: float | None) -> Iterator[Alarm]:
    if share is not None and share < WEAK_LINK:
        advice = "To do: LAND it, or clear the way to it. Without a link it hovers, then lands by itself."
        yield Alarm(f"{name} link", f"{name}: weak link, {share:.0%} arrives", share < BAD_LINK, advice)


def _tracker(state: MonitorState, now_ns: int) -> Iterator[Alarm]:
    if state.estimate is None:
        return
    age = state.estimate.age_s(now_ns)
    if age > ESTIMATE_SILENT_S:
        advice = "Nothing to do: drones hover, then land."
        yield Alarm("tracker silent", f"tracker: no estimate for {age:.1f} s", advice=advice)
    for target in map(state.entity, state.cast.targets):
        if target is not None and target.age_s > TARGET_LOST_S:
            advice = "Nothing to do: who is in TRACK looks for it."
            yield Alarm(f"{target.name} lost", f"{target.name}: not seen for {target.age_s:.0f} s", False, advice)


def _cameras(state: MonitorState, now_ns: int) -> Iterator[Alarm]:
    for name, seen in state.cameras.items():
        if not seen.message.connected or seen.age_s(now_ns) > CAMERA_SILENT_S:
            why = f" ({seen.message.detail})" if seen.message.detail else ""
            yield Alarm(f"{name} pictures", f"{name}: no pictures{why}", False, "To do: see to its power and cable.")


def _processes(state: MonitorState, now_ns: int) -> Iterator[Alarm]:
    for name, seen in state.processes.items():
        status = seen.message
        if seen.age_s(now_ns) > PROCESS_SILENT_S and status.state is not Lifecycle.STOPPING:
            yield Alarm(f"process {name} silent", f"process {name}: silent for {seen.age_s(now_ns):.0f} s")
        elif status.state is Lifecycle.DEGRADED:
            yield Alarm(f"process {name} degraded", f"process {name}: {status.detail or 'degraded'}", False)


def _events(state: MonitorState, now_ns: int) -> Iterator[Alarm]:
    for seen in state.events:
        if seen.message.severity is Severity.ERROR and seen.age_s(now_ns) < _EVENT_SHOWN_S:
            yield Alarm(seen.message.sentence, seen.message.sentence, advice=seen.message.remedy)
