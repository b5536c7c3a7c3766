"""Alarms for the operator, derived from the state. Pure."""

import math
from collections.abc import Iterator, Sequence
from itertools import combinations

from groundstation.bus.messages import (
    AIRBORNE,
    NEVER_S,
    NOT_DOWN,
    STANDING,
    EntityEstimate,
    FlightState,
    Lifecycle,
    Severity,
    TargetSearch,
    VehicleStatus,
    climbs,
    stood_last,
)
from groundstation.field.drones import camera_name
from groundstation.monitor.alarm import TO_DO, Alarm
from groundstation.monitor.batteries import Battery, Charge, battery_of
from groundstation.monitor.before_flight import forbidding
from groundstation.monitor.endurance import flies, may_fly
from groundstation.monitor.failsafe_words import failsafe_words, will_land
from groundstation.monitor.state import MonitorState

VEHICLE_SILENT_S = 1.0
ESTIMATE_SILENT_S = 0.3
PROCESS_SILENT_S = 3.0
CAMERA_SILENT_S = 2.0
DARK = 0.08  # mean brightness, as a share of white
WEAK_LINK, BAD_LINK = 0.6, 0.3
_EVENT_SHOWN_S = 8.0
_SPEAKS_HZ = 5.0
_BEFORE_FLIGHT = {
    Charge.LOW: "charge it before it flies again",
    Charge.EMPTY: "charge it before it flies again",
    Charge.UNKNOWN: "until it is known it may not take off",
}
_AFTER_LANDING = "Nothing to do now: check its power and cable once all have landed."
_DARK_ADVICE = "Nothing to do: who is not seen lands by itself, unless there is light again."
_SWITCHED_OFF = "Nothing to do now: switch it on before it flies again."
_SEARCH = "Nothing to do: the drones look for it."
_WAITS = "Nothing to do now: drones look for it once they track."
_DATED = "Nothing to do now: they count from their arrival. Check the clock of its host once all have landed."
_RESTARTED = "Nothing to do: it is restarted if it hangs."
_CALL = f"{TO_DO}check its marker and the light; drive it into the middle of the room; or LAND ALL."
_CUT = "CUT"
_STAY_AWAY = f"{TO_DO}stay away until all have landed (LAND ALL); then set it upright on its pad."
_DOWN = {
    FlightState.EMERGENCY: ("EMERGENCY, its motors are off", _STAY_AWAY),
    FlightState.LOST: ("its driver no longer hears it", f"{TO_DO}check its battery and its link."),
}


def alarms_of(state: MonitorState, now_ns: int) -> list[Alarm]:
    """Return all alarms: first those that require an action, then the grave ones."""
    alarms = [
        *_vehicles(state, now_ns),
        *_tracker(state, now_ns),
        *_near(state, now_ns),
        *_cameras(state, now_ns),
        *_lost(state),
        *_processes(state, now_ns),
        *_events(state, now_ns),
        *_suspected(state),
        *_standing(state),
    ]
    return sorted(dict.fromkeys(alarms), key=lambda alarm: (not alarm.asks, not alarm.grave))


def _vehicles(state: MonitorState, now_ns: int) -> Iterator[Alarm]:
    for name, seen in state.vehicles.items():
        status, is_silent = seen.message, seen.age_s(now_ns) > VEHICLE_SILENT_S
        if is_silent:
            yield _silent(name, seen.age_s(now_ns), status)
        else:
            yield from _failsafe(name, status)
        if stood_last(status.flight_state, status.mode):
            yield Alarm(f"{name} LOST", f"{name}: not heard any more, it stood until then", False, _SWITCHED_OFF)
        elif down := _down(state, status):
            words, advice = _not_believed(status) if _is_heard_in_vain(status) else down
            yield Alarm(f"{name} {status.flight_state}", f"{name}: {words}", advice=advice)
        if flies(status, state.take_offs.get(name)) and not is_silent and status.failsafe not in NOT_DOWN:
            yield from _battery(name, status, battery_of(state, name))
            yield from _link(name, status.link_quality)


def _silent(name: str, age_s: float, status: VehicleStatus) -> Alarm:
    about, text = f"{name} silent", f"{name}: nothing heard for {age_s:.0f} s"
    if status.flight_state in STANDING and not climbs(status.flight_state, status.mode):
        return Alarm(about, f"{text}, it stood until then", False, _SWITCHED_OFF)
    return Alarm(about, text, advice=f"Nothing to do: {_left_alone(status)}. Stops are sent to it.")


def _down(state: MonitorState, status: VehicleStatus) -> tuple[str, str] | None:
    """Return words and advice for a vehicle that is down other than by landing, or None.

    Of those whose motors were cut only an AR.Drone reports an emergency; others report that they stand.
    """
    if status.mode == _CUT and status.flight_state is FlightState.LANDED and _anybody_flies(state):
        return "its motors were cut", _STAY_AWAY
    return _DOWN.get(status.flight_state)


def _anybody_flies(state: MonitorState) -> bool:
    return any(flies(seen.message, state.take_offs.get(name)) for name, seen in state.vehicles.items())


def _is_heard_in_vain(status: VehicleStatus) -> bool:
    """Return whether a driver refuses all its vehicle's telemetry: no more is known of it than of a silent one."""
    lost = status.flight_state is FlightState.LOST and status.mode != "CONNECTING"
    return lost and status.rate_hz >= _SPEAKS_HZ


def _not_believed(status: VehicleStatus) -> tuple[str, str]:
    told = status.mode == "LANDING" and status.detail and not status.detail.startswith("land")
    words = status.detail if told else "what it says is not believed"
    return words, f"Nothing to do: {_left_alone(status)}. Check its sensors then."


def _left_alone(status: VehicleStatus) -> str:
    return "it lands" if _lands(status) else "it hovers, then lands"


def _lands(status: VehicleStatus) -> bool:
    """Return whether a vehicle lands, or was just ordered to; not of one that does not come down."""
    lands = status.flight_state is FlightState.LANDING or status.mode == "LANDING"
    return lands and status.failsafe not in NOT_DOWN


def _failsafe(name: str, status: VehicleStatus) -> Iterator[Alarm]:
    if words := failsafe_words(status):
        yield Alarm(f"{name} {words.about}", f"{name} {words.text}", words.grave, words.advice)


def _standing(state: MonitorState) -> Iterator[Alarm]:
    """Yield alarms about batteries of drones on the floor, which come after all alarms about flying drones."""
    for name, seen in state.vehicles.items():
        status, battery = seen.message, battery_of(state, name)
        unheard = battery.level is None and status.flight_state is FlightState.UNKNOWN
        if battery.charge is not Charge.GOOD and not unheard and not flies(status, state.take_offs.get(name)):
            advice = f"Nothing to do now: {_BEFORE_FLIGHT[battery.charge]}."
            yield Alarm(f"{name} battery", f"{name}: {battery.words}", False, advice)


def _battery(name: str, status: VehicleStatus, battery: Battery) -> Iterator[Alarm]:
    if battery.charge is Charge.GOOD:
        return
    about, held = f"{name} battery", f"{name}: {battery.words}"
    lands = f"{'if that lasts' if battery.level is None else f'at {battery.limit:.0%}'} a drone lands by itself"
    below = battery.level is not None and battery.level < battery.limit
    if _lands(status) or (below and status.lands_in_s is not None):
        yield Alarm(about, f"{held}, it lands", False, "Nothing to do.")
    elif battery.charge is Charge.EMPTY:
        advice = f"{TO_DO}press Land on its card now; {lands}, wherever it is."
        yield Alarm(about, f"{held}{battery.good_for}", below, advice)
    else:
        yield Alarm(about, f"{held}{battery.good_for}", False, f"Nothing to do yet: {lands}.")


def _link(name: str, share: float | None) -> Iterator[Alarm]:
    if share is not None and share < WEAK_LINK:
        advice = f"{TO_DO}press Land on its card, or move what shields its radio. Without a link it lands by itself."
        yield Alarm(f"{name} link", f"{name}: weak link, {share:.0%} arrives", share < BAD_LINK, advice)


def _tracker(state: MonitorState, now_ns: int) -> Iterator[Alarm]:
    if state.estimate is None:
        return
    age = state.estimate.age_s(now_ns)
    if age > ESTIMATE_SILENT_S:
        in_flight = _anybody_flies(state)
        may = any(may_fly(seen.message, state.take_offs.get(name)) for name, seen in state.vehicles.items())
        nobody = "nobody is known to fly" if may else "nobody flies"
        advice = "Nothing to do: drones hover, then land." if in_flight else f"Nothing to do now: {nobody}."
        yield Alarm("tracker silent", f"tracker: no estimate for {age:.1f} s", in_flight, advice)


def _near(state: MonitorState, now_ns: int) -> Iterator[Alarm]:
    """Yield pairs of flying drones that are nearer than allowed."""
    if state.estimate is None or state.estimate.age_s(now_ns) > ESTIMATE_SILENT_S:
        return
    lands = {n: _lands(seen.message) for n, seen in state.vehicles.items() if seen.message.flight_state in AIRBORNE}
    places = {one.name: one.mean[:3] for one in state.estimate.message.entities if one.name in lands}
    for pair in combinations(places, 2):
        apart_m, least_m = math.dist(*(places[name] for name in pair)), state.cast.min_separation_m
        if apart_m < least_m:
            text = f"{pair[0]} and {pair[1]} are {apart_m:.2f} m apart, at least {least_m:g} m is allowed"
            yield Alarm(f"{' '.join(pair)} near", text, False, _apart(any(lands[name] for name in pair)))


def _apart(one_lands: bool) -> str:
    if one_lands:
        return "Nothing to do: it lands."
    return "Nothing to do: they are moved apart; if that does not help, one lands."


def _lost(state: MonitorState) -> Iterator[Alarm]:
    """Yield alarms about lost robots and targets; a drone that lands because it is lost has that alarm instead."""
    if state.estimate is None:
        return
    estimate = state.estimate.message
    searched = {search.target for search in estimate.searches}
    for entity in estimate.entities:
        unknown_s = max(entity.age_s, entity.unlocalised_s)
        if unknown_s <= state.cast.lost_after_s or entity.name in searched:
            continue
        seen = state.vehicles.get(entity.name)
        if entity.name in state.cast.targets:
            advice = _SEARCH if any(one.message.mode == "TRACK" for one in state.vehicles.values()) else _WAITS
        elif seen and will_land(seen.message):
            left_s = max(0.0, state.cast.unseen_land_s - unknown_s)
            within = f" within {left_s:.0f} s" if unknown_s < NEVER_S else ""
            soon = f" by itself{within}, unless it is seen"
            advice = f"Nothing to do: it lands{'' if _lands(seen.message) else soon}."
        else:
            continue
        yield Alarm(f"{entity.name} lost", _lost_words(state, entity), False, advice)
    yield from map(_searched, estimate.searches)


def _lost_words(state: MonitorState, entity: EntityEstimate) -> str:
    """Return the words for an entity that is not seen, or that is seen and nevertheless not known to be there."""
    if entity.age_s > state.cast.lost_after_s:
        return f"{entity.name} is lost: not seen for {entity.age_s:.0f} s"
    since = f" for {entity.unlocalised_s:.0f} s" if entity.unlocalised_s < NEVER_S else ""
    return f"{entity.name}: not known where it is{since}"


def _searched(search: TargetSearch) -> Alarm:
    """Return the alarm for a target without a usable estimate, no longer or not yet."""
    about, (x, y) = f"{search.target} lost", search.place_m
    if search.mode == "LOST":
        text = f"{search.target} is not found: {search.searched:.0%} of {search.floor} was searched"
        return Alarm(about, text, False, _CALL)
    text = f"{search.target} is lost, most likely near ({x:.1f}, {y:.1f})"
    if search.expected_s is None:
        return Alarm(about, f"{text}; no drone is free to search", False, _CALL)
    return Alarm(about, text, False, _SEARCH)


def _cameras(state: MonitorState, now_ns: int) -> Iterator[Alarm]:
    dark = []
    for name, seen in state.cameras.items():
        if not seen.message.connected or seen.age_s(now_ns) > CAMERA_SILENT_S:
            why = f" ({seen.message.detail})" if seen.message.detail else ""
            yield Alarm(f"{name} pictures", f"{name}: no pictures{why}", False, _AFTER_LANDING)
        elif (light := seen.message.brightness) is not None and light < DARK and not _stands_with(state, name):
            dark.append(name)
    if dark:
        yield Alarm("dark", _dark_words(sorted(dark)), False, _DARK_ADVICE)


def _dark_words(names: Sequence[str]) -> str:
    """Return the words for one dark camera, or for several together: then the cause is the light."""
    if len(names) == 1:
        return f"{names[0]}: its picture is dark, it sees nobody"
    return f"{', '.join(names[:-1])} and {names[-1]}: their pictures are dark, they see nobody"


def _stands_with(state: MonitorState, camera: str) -> bool:
    """Return whether a camera belongs to a drone on the floor, where its picture means nothing."""
    carriers = (seen.message for drone, seen in state.vehicles.items() if camera_name(drone) == camera)
    return any(carrier.flight_state not in AIRBORNE for carrier in carriers)


def _processes(state: MonitorState, now_ns: int) -> Iterator[Alarm]:
    for name, seen in state.processes.items():
        status = seen.message
        if seen.age_s(now_ns) > PROCESS_SILENT_S and status.state is not Lifecycle.STOPPING:
            yield Alarm(
                f"process {name} silent", f"process {name}: silent for {seen.age_s(now_ns):.0f} s", advice=_RESTARTED
            )
        elif status.state is Lifecycle.DEGRADED:
            yield Alarm(
                f"process {name} degraded",
                f"process {name}: {status.detail or 'degraded'}",
                False,
                "Nothing to do now.",
            )
    for name, ahead in state.ahead.items():
        if ahead.age_s(now_ns) < _EVENT_SHOWN_S:
            text = f"process {name}: dates its messages {ahead.message:.0f} s ahead"
            yield Alarm(f"process {name} ahead", text, False, _DATED)


def _events(state: MonitorState, now_ns: int) -> Iterator[Alarm]:
    young = [seen.message for seen in state.events if seen.age_s(now_ns) < _EVENT_SHOWN_S]
    told = [(one.sentence, one.remedy) for one in young if one.severity is Severity.ERROR]
    for sentence, remedy in (*told, *forbidding(state, now_ns)):
        yield Alarm(sentence, sentence, advice=f"{TO_DO}{remedy}" if remedy else "")


def _suspected(state: MonitorState) -> Iterator[Alarm]:
    """Yield figures of the field that the diagnosis suspects, until it withdraws them."""
    for one in state.suspicion.figures if state.suspicion else ():
        advice = f"Nothing to do now. When all have landed: {one.remedy}."
        about = f"suspected {one.about} {one.told_ns}"
        yield Alarm(about, f"Suspected: {one.text}", False, advice, one.told_ns)
