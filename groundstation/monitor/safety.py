"""The state of the team in one word, with a reason. Pure."""

from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum

from groundstation.bus.messages import AIRBORNE, UNHEARD, FlightState, VehicleStatus, climbs
from groundstation.monitor.alarm import Alarm
from groundstation.monitor.batteries import battery_of
from groundstation.monitor.endurance import flies, may_fly
from groundstation.monitor.state import MonitorState
from groundstation.time_units import NS_PER_S

# A drone joins the estimate within 0.3 s of its climb.
_JOINS_NS = NS_PER_S


class Level(StrEnum):
    """SAFE: nothing is wrong. WATCH: something is, but needs no action. ACT: the operator must do something now."""

    SAFE = "SAFE"
    WATCH = "WATCH"
    ACT = "ACT"


@dataclass(frozen=True, slots=True)
class Safety:
    """The level, and its reason in a sentence or two."""

    level: Level
    reason: str


def safety_of(state: MonitorState, alarms: Sequence[Alarm]) -> Safety:
    """Judge the team by its present alarms, in the order of `alarms_of`."""
    if alarms:
        first = alarms[0]
        return Safety(Level.ACT if first.asks else Level.WATCH, f"{first.text}. {first.advice}".rstrip())
    if set(state.cast.drones) - set(state.vehicles):
        return Safety(Level.WATCH, "Not every drone has been heard yet.")
    unsure = [name for name, seen in state.vehicles.items() if _is_unsure(seen.message)]
    if unsure:
        return Safety(Level.WATCH, _unsure_words(state, unsure))
    up = [name for name, seen in state.vehicles.items() if _is_up(seen.message)]
    if not up:
        return Safety(Level.SAFE, "No alarms. Nobody flies.")
    if unplaced := [name for name in up if _is_unplaced(state, name)]:
        return Safety(Level.WATCH, _unplaced_words(unplaced))
    return Safety(Level.SAFE, f"No alarms. All who fly are heard, nobody is lost{_lasting(state, up)}.")


def _is_up(status: VehicleStatus) -> bool:
    """Return whether a vehicle flies, or was ordered to, which it may do before it says so."""
    return status.flight_state in AIRBORNE or climbs(status.flight_state, status.mode)


def _is_unsure(status: VehicleStatus) -> bool:
    """Return whether a vehicle that is not heard may fly."""
    return status.flight_state in UNHEARD and may_fly(status, None) and not flies(status, None)


def _unsure_words(state: MonitorState, names: Sequence[str]) -> str:
    unheard = any(state.vehicles[name].message.mode == "CONNECTING" for name in names)
    heard = "Not every drone has been heard yet: it" if unheard else "It"
    return f"{heard} is not known whether {_who(names)} {'fly' if len(names) > 1 else 'flies'}."


def _who(names: Sequence[str]) -> str:
    return " and ".join(names) if len(names) < 3 else f"{len(names)} drones"


def _is_unplaced(state: MonitorState, name: str) -> bool:
    """Return whether a flying drone's place is contradicted, or has not been estimated since its climb."""
    entity = state.entity(name)
    if entity is not None:
        return entity.contradicted
    stamp_ns = state.vehicles[name].stamp_ns
    return stamp_ns - state.climbed_ns.get(name, stamp_ns) > _JOINS_NS


def _unplaced_words(names: Sequence[str]) -> str:
    return f"It is not known where {_who(names)} {'are' if len(names) > 1 else 'is'}."


def _lasting(state: MonitorState, up: Sequence[str]) -> str:
    stay = [name for name in up if state.vehicles[name].message.flight_state is not FlightState.LANDING]
    known = [left for name in stay if (left := battery_of(state, name).endurance) is not None]
    if not known or len(known) < len(stay):
        return ""
    return f"; the first must land for its battery in {min(known, key=lambda left: left.minutes).words}"
