"""A vehicle's charge: of two messages, maybe of different batteries, and of its autopilot's judgement. Pure."""

from dataclasses import dataclass, replace

from drivers.mavlink.wire.names import ChargeState
from drivers.mavlink.wire.telemetry import BatteryStatus
from groundstation.time_units import NS_PER_S

# Each is requested once a second at least; an older one counts as unknown.
_FRESH_NS = 10 * NS_PER_S
_SPENT = {
    ChargeState.CRITICAL: "is critical",
    ChargeState.EMERGENCY: "is all but empty",
    ChargeState.FAILED: "has failed",
}


@dataclass(frozen=True, slots=True)
class Batteries:
    """The last reports: charges 0 to 1, None: never told; with their times.

    lowest: of SYS_STATUS; first: of battery 0 in BATTERY_STATUS; state: that battery's MAV_BATTERY_CHARGE_STATE.
    """

    lowest: float | None = None
    lowest_ns: int = 0
    first: float | None = None
    first_ns: int = 0
    state: int = 0
    state_ns: int = 0

    def with_lowest(self, now_ns: int, percent: int) -> "Batteries":
        """Return these with the charge of a SYS_STATUS [%]."""
        # WIRE: -1 means unknown; a charge known a moment ago still holds.
        return replace(self, lowest=min(percent, 100) / 100, lowest_ns=now_ns) if percent >= 0 else self

    def with_first(self, now_ns: int, status: BatteryStatus) -> "Batteries":
        """Return these with the report of battery 0."""
        known = replace(self, state=status.charge_state, state_ns=now_ns)
        percent = status.battery_remaining
        return replace(known, first=min(percent, 100) / 100, first_ns=now_ns) if percent >= 0 else known

    def charge(self, now_ns: int) -> float | None:
        """Return the lower charge of the last 10 s, 0 while the autopilot judges battery 0 critical; None: unknown."""
        # WIRE (docs/reference/mavlink.md 5.14): ArduPilot's charge is 100 % at power-on, whatever the battery holds.
        if self.state in _SPENT and now_ns - self.state_ns < _FRESH_NS:
            return 0.0
        told = ((self.lowest, self.lowest_ns), (self.first, self.first_ns))
        return min((one for one, at_ns in told if one is not None and now_ns - at_ns < _FRESH_NS), default=None)

    def news(self, status: BatteryStatus) -> str:
        """Return the warning for a report of battery 0 that judges it lower than the one before, or ""."""
        if status.charge_state == self.state:
            return ""
        if status.charge_state in _SPENT:
            how = _SPENT[ChargeState(status.charge_state)]
            return f"its autopilot says that its battery {how}: its charge counts as 0 %"
        is_low = status.charge_state == ChargeState.LOW and self.state not in _SPENT
        return "its autopilot says that its battery is low" if is_low else ""
