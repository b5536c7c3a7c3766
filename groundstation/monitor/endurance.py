"""Remaining flight time of batteries: by a kind's usual flight time, and increasingly by this flight's drain. Pure."""

from dataclasses import dataclass

from groundstation.bus import messages as m
from groundstation.bus.messages import AIRBORNE, UNHEARD, FlightState, VehicleStatus

# Least charge spent, and least time, before the drain is used for a kind without a usual one.
_LEAST_DRAIN, _LEAST_MIN = 0.02, 0.5
# Weight of a kind's usual drain, in minutes of this flight: a battery reports its charge in whole percent.
# Until _LEAST_MIN the usual drain counts alone, from twice that on a flight counts in full.
_USUAL_MIN = 1.0
_NS_PER_MIN = 60e9
_DOWN = frozenset({"LANDED", "CUT"})  # modes of drivers


@dataclass(frozen=True, slots=True)
class TakeOff:
    """Time of a drone's first status in the air, and its battery level then; None until it is known."""

    stamp_ns: int
    battery: float | None


@dataclass(frozen=True, slots=True)
class Endurance:
    """Minutes until a battery lands its drone."""

    minutes: float

    @property
    def words(self) -> str:
        """Return "~6 min"."""
        return "< 1 min" if self.minutes < 1.0 else f"~{int(self.minutes)} min"


def flies(status: VehicleStatus, take_off: TakeOff | None) -> bool:
    """Return whether a vehicle is in the air, or was by its last status; `take_off` counts where that does not say."""
    by_status = m.flies(status.flight_state, status.mode)
    if by_status is not None:
        return by_status
    rises, lost = status.flight_state is FlightState.TAKING_OFF, status.flight_state is FlightState.LOST
    return rises or (lost and status.mode not in _DOWN and take_off is not None)


def may_fly(status: VehicleStatus, take_off: TakeOff | None) -> bool:
    """Return whether a vehicle flies, or may: ordered up, or not heard while its driver does not have it down."""
    unheard = status.flight_state in UNHEARD and status.mode not in _DOWN
    return flies(status, take_off) or m.climbs(status.flight_state, status.mode) or unheard


def take_off_of(known: TakeOff | None, stamp_ns: int, status: VehicleStatus) -> TakeOff | None:
    """Return the take-off that this status belongs to: none on the floor; anew with a fuller battery or in the past."""
    state, battery = status.flight_state, status.battery
    if state is FlightState.LOST:
        return known if known is not None and stamp_ns >= known.stamp_ns and status.mode not in _DOWN else None
    if state not in AIRBORNE:
        return None
    if known is None or stamp_ns < known.stamp_ns:
        return TakeOff(stamp_ns, battery)
    fuller = battery is not None and (known.battery is None or battery > known.battery)
    return TakeOff(stamp_ns, battery) if fuller else known


def endurance(
    stamp_ns: int, battery: float, limit: float, take_off: TakeOff | None, flight_time_s: float | None
) -> Endurance | None:
    """Return the remaining flight time of a battery; None if unknown.

    battery, limit: shares of a full one, at `stamp_ns` and when it lands its drone. flight_time_s: of a full battery,
    None if its kind states none.
    """
    left, minutes, spent = max(0.0, battery - limit), 0.0, 0.0
    if take_off is not None and take_off.battery is not None:
        minutes, spent = (stamp_ns - take_off.stamp_ns) / _NS_PER_MIN, take_off.battery - battery
    if flight_time_s is not None:
        usual, counts = _USUAL_MIN / (flight_time_s / 60.0), min(1.0, max(0.0, minutes / _LEAST_MIN - 1.0))
        return Endurance(left * (_USUAL_MIN + counts * minutes) / (usual + counts * spent))
    believed = minutes >= _LEAST_MIN and spent >= _LEAST_DRAIN
    return Endurance(left * minutes / spent) if believed else None
