"""When drones were in the air: by their own reports, which a truth with gaps does not replace."""

from collections.abc import Collection, Iterable

import numpy as np

from groundstation.arrays import Array, BoolArray
from groundstation.bus.messages import AIRBORNE, STANDING, UNHEARD, FlightState, VehicleStatus
from groundstation.report.tracks import RunData, TimedMessage

Said = tuple[Array, BoolArray]
"""Times in order (n) [s], and what held from each on (n)."""


def aloft_at(
    statuses: Iterable[TimedMessage[VehicleStatus]], time_s: Array, states: Collection[FlightState] = AIRBORNE
) -> BoolArray:
    """Return for each time whether a drone was in one of some states (m): unchanged while it is silent, False before.

    time_s: [s since the first message]; states: those in the air.
    """
    return held_at(_said(statuses, states), time_s)


def held_at(said: Said, time_s: Array) -> BoolArray:
    """Return for each time whether something held by what was said last (m): False before."""
    said_s, held = said
    found: BoolArray = np.append(False, held)[np.searchsorted(said_s, time_s, side="right")]
    return found


def flights_of(data: RunData, name: str) -> Said:
    """Return when a drone left the floor and was on it again [s], and whether it flew from then on.

    By a simulator's truth, which also knows of a drone that is not heard; else by its own reports.
    """
    truth = data.truth.get(name)
    if truth is not None and truth.is_simulated:
        said_s, flies = truth.time_s, ~truth.on_ground
    else:
        said_s, flies = _said(data.vehicles.get(name, ()), AIRBORNE)
    changes = np.flatnonzero(np.diff(flies, prepend=False))
    return said_s[changes], flies[changes]


def _said(statuses: Iterable[TimedMessage[VehicleStatus]], states: Collection[FlightState]) -> Said:
    told = [(item.time_s, item.message.flight_state) for item in statuses]
    said = sorted((at_s, state in states) for at_s, state in told if state not in UNHEARD)
    return np.array([at_s for at_s, _ in said]), np.array([flies for _, flies in said], dtype=bool)


def anybody_flew(data: RunData) -> bool:
    """Return whether any drone was ever in the air, by its own report or by the truth."""
    reported = (item.message.flight_state in AIRBORNE for said in data.vehicles.values() for item in said)
    seen = (not data.truth[name].on_ground.all() for name in data.drones if name in data.truth)
    return any(reported) or any(seen)


def in_the_air(data: RunData) -> tuple[float, float] | None:
    """Return the first take-off and the last landing [s], by the drones' reports; None if none reported a flight."""
    flights = [flight for said in data.vehicles.values() if (flight := _flight(said, data.end_s))]
    return (min(start for start, _ in flights), max(end for _, end in flights)) if flights else None


def _flight(statuses: Iterable[TimedMessage[VehicleStatus]], end_s: float) -> tuple[float, float] | None:
    told = [(item.time_s, item.message.flight_state) for item in statuses]
    up = [at_s for at_s, state in told if state in AIRBORNE]
    if not up:
        return None
    down = [at_s for at_s, state in told if state in STANDING and at_s > max(up)]
    return min(up), min(down, default=end_s)
