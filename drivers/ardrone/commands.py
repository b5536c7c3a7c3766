"""AT commands for a decision of the watchdog. Pure.

WIRE (docs/reference/ardrone.md 2.4): REF bit 9 is a level (1 take off and stay up, 0 land), bit 8 toggles the emergency
on its rising edge. PCMD flag 0 lets the drone hold its place. phi > 0 right, theta > 0 backward, gaz > 0 up, yaw > 0
clockwise.
"""

from drivers.ardrone.desired_config import Scale
from drivers.ardrone.velocity_loop import AttitudeRequest
from drivers.ardrone.wire import at
from drivers.ardrone.wire.at import AtCommand
from drivers.ardrone.wire.state import StateBit
from drivers.watchdog_types import Action
from groundstation.bus.messages import FlightState
from groundstation.time_units import NS_PER_MS

# After 2 s without commands a drone hovers, half a second later it lands: a state as old as this may be over when the
# next command arrives, and that must not lift the drone again.
STALE_NS = 1500 * NS_PER_MS
_STAYS_UP = (Action.FLY, Action.HOVER)


def orders_from_decision(
    action: Action, attitude: AttitudeRequest, state: int, flight_state: FlightState, scale: Scale, stale: bool = False
) -> list[AtCommand]:
    """Return REF and PCMD for an action, and COMWDG if the drone missed our commands; no REF while waiting.

    attitude: of a drone that flies a setpoint, or that must be braked to hover. stale: its state is older than
    `STALE_NS`, so that it may have landed or been restarted; one that flies stays up by its last REF.
    """
    steered = action in _STAYS_UP
    motion = motion_from_attitude(attitude, scale) if steered else at.ProgressiveMotion()
    orders = [at.pcmd(motion)]
    starts_nothing = action is Action.WAIT or (stale and action in (*_STAYS_UP, Action.TAKE_OFF))
    if not starts_nothing:
        orders.insert(0, _reference(action, bool(state & StateBit.EMERGENCY), flight_state))
    if starts_nothing or state & StateBit.COM_WATCHDOG:
        orders.insert(0, at.comwdg())
    return orders


def _reference(action: Action, emergency: bool, flight_state: FlightState) -> AtCommand:
    match action:
        case Action.TAKE_OFF:
            return at.ref(start=not emergency)
        case Action.CLEAR:
            # The emergency button is pressed once more, and the drone stays down.
            return at.ref(start=False, select=emergency)
        case Action.FLY | Action.HOVER:
            # Stay up, but never take off: a drone that stands, or that others landed, is not lifted again.
            return at.ref(start=flight_state not in (FlightState.LANDED, FlightState.LANDING))
        case Action.CUT:
            return at.ref(start=False, select=not emergency)
        case _:
            return at.ref(start=False)


def motion_from_attitude(attitude: AttitudeRequest, scale: Scale) -> at.ProgressiveMotion:
    """Return the PCMD of an attitude: fractions of the configured limits, in the drone's signs."""
    if attitude.hover:
        return at.ProgressiveMotion()
    return at.ProgressiveMotion(
        at.PCMD_PROGRESSIVE,
        phi=attitude.roll_rad / scale.tilt_rad,
        theta=-attitude.pitch_rad / scale.tilt_rad,
        gaz=attitude.climb_m_s / scale.climb_m_s,
        yaw=-attitude.yaw_rate_rad_s / scale.yaw_rate_rad_s,
    )
