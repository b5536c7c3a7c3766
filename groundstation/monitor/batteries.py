"""The state of each battery: its remaining flight time, and whether that is too short. Pure."""

from dataclasses import dataclass
from enum import StrEnum

from groundstation.bus.messages import FlightState
from groundstation.monitor.endurance import Endurance, endurance, flies
from groundstation.monitor.state import MonitorState

LIMIT = 0.15  # for a drone whose own limit is not known
_LOW, _EMPTY = 0.15, 0.05  # above the limit
_LOW_MIN, _EMPTY_MIN = 3.0, 1.0


class Charge(StrEnum):
    """State of a battery, by its level and, in the air, by the minutes left."""

    GOOD = "good"
    LOW = "low"
    EMPTY = "empty"
    UNKNOWN = "unknown"


@dataclass(frozen=True, slots=True)
class Battery:
    """level: share of a full one, None if unknown. limit: the level at which its drone lands."""

    level: float | None
    limit: float
    endurance: Endurance | None
    charge: Charge

    @property
    def words(self) -> str:
        """Return "battery 71%"."""
        return "battery unknown" if self.level is None else f"battery {self.level:.0%}"

    @property
    def good_for(self) -> str:
        """Return ", good for ~6 min"; "" if unknown."""
        return f", good for {self.endurance.words}" if self.endurance else ""


def battery_of(state: MonitorState, name: str) -> Battery:
    """Return the battery of a drone whose status was received."""
    seen, limit = state.vehicles[name], state.cast.drones.get(name, LIMIT)
    status = seen.message
    if status.battery is None:
        return Battery(None, limit, None, Charge.UNKNOWN)
    usual_s = state.cast.flight_times_s.get(name)
    take_off = state.take_offs.get(name)
    left = endurance(seen.stamp_ns, status.battery, limit, take_off, usual_s)
    spends = flies(status, take_off) and status.flight_state is not FlightState.LANDING
    minutes = left.minutes if left is not None and spends else float("inf")
    return Battery(status.battery, limit, left, _charge(status.battery - limit, minutes))


def _charge(above: float, minutes: float) -> Charge:
    if above < _EMPTY or minutes < _EMPTY_MIN:
        return Charge.EMPTY
    return Charge.LOW if above < _LOW or minutes < _LOW_MIN else Charge.GOOD
