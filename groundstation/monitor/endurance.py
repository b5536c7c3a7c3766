"""Remaining flight time of batteries: by a kind's usual flight time, and increasingly by this flight's drain. Pure."""

from dataclasses import dataclass

from groundstation.bus.messages import AIRBORNE, FlightState, VehicleStatus

# Least charge spent, and least time, before the drain is used for a kind without a usual one.
_LEAST_DRAIN, _LEAST_MIN = 0.02, 0.5
# Weight of a kind's usual drain, in minutes of this flight: a battery reports its charge in whole percent.
# Until _LEAST_MIN the usual drain counts alone, from twice that on a flight counts in full.
_USUAL_MIN = 1.0
_NS_PER_MIN = 60e9


@dataclass(frozen=True, slots=True)
class TakeOff:
    """Time of a drone's first status in the air, and its battery level then."""

    stamp_ns: int
    battery: float


@dataclass(frozen=True, slots=True)
class Endurance:
    """Minutes until a battery lands its drone."""

    minutes: float

    @property
    def words(self) -> str:
        """Return "~6 min"."""
        return "< 1 min" if self.minutes < 1.0 else f"~{int(self.minutes)} min"


def flies(status: VehicleStatus, take_off: TakeOff | None) -> bool:
    """Return whether a vehicle is in the air, or was by its last status."""
    return status.flight_state in AIRBORNE or (status.flight_state is FlightState.LOST and take_off is not None)


def take_off_of(known: TakeOff | None, stamp_ns: int, status: VehicleStatus) -> TakeOff | None:
    """Return the take-off that this status belongs to: none on the floor; anew with a fuller battery or in the past."""
    if status.flight_state is FlightState.LOST:
        return known if known is not None and stamp_ns >= known.stamp_ns else None
    if status.battery is None or status.flight_state not in AIRBORNE:
        return None
    if known is None or stamp_ns < known.stamp_ns or status.battery > known.battery:
        return TakeOff(stamp_ns, status.battery)
    return known


def endurance(
    stamp_ns: int, battery: float, limit: float, take_off: TakeOff | None, flight_time_s: float | None
) -> Endurance | None:
    """Return the remaining flight time of a battery; None if unknown.

    battery, limit: shares of a full one, at `stamp_ns` and when it lands its drone. flight_time_s: of a full battery,
    None if its kind states none.
    """
    left, minutes, spent = max(0.0, battery - limit), 0.0, 0.0
    if take_off is not None:
        minutes, spent = (stamp_ns - take_off.stamp_ns) / _NS_PER_MIN, take_off.battery - battery
    if flight_time_s is not None:
        usual, counts = _USUAL_MIN / (flight_time_s / 60.0), min(1.0, max(0.0, minutes / _LEAST_MIN - 1.0))
        return Endurance(left * (_USUAL_MIN + counts * minutes) / (usual + counts * spent))
    believed = minutes >= _LEAST_MIN and spent >= _LEAST_DRAIN
    return Endurance(left * minutes / spent) if believed else None
