"""State word and control state of an emulated AR.Drone."""

from drivers.ardrone.wire.state import (
    FLYING_COMBINED_YAW,
    HEALTHY,
    HOVERING_LOST_COM,
    HOVERING_MAGNETO_CALIB,
    TAKE_OFF_AUTO,
    ControlState,
    StateBit,
    join_control_state,
)
from sim_bridge.devices.ardrone_control import BATTERY_LOW, FlightControl
from sim_bridge.devices.ardrone_session import CommandLink
from sim_bridge.world.ardrone import Quadrotor
from sim_bridge.world.ardrone_autopilot import Phase

# Plain numbers: an enum takes longer to find a member than a word to be put together.
_ALWAYS, _CAMERA = int(HEALTHY | StateBit.ALTITUDE), int(StateBit.CAMERA)
_FLIES, _START = int(StateBit.FLY | StateBit.VISION), int(StateBit.USER_FEEDBACK_START)
_ACK, _BATTERY = int(StateBit.COMMAND), int(StateBit.VBAT_LOW)
_BOOTSTRAP, _DEMO = int(StateBit.NAVDATA_BOOTSTRAP), int(StateBit.NAVDATA_DEMO)
_CUT, _TAKING_OFF, _FLYING, _HOVERING = Phase.CUT, Phase.TAKING_OFF, Phase.FLYING, Phase.HOVERING
_ALIVE = CommandLink.ALIVE
_MAJOR = {
    Phase.LANDED: ControlState.LANDED,
    Phase.TAKING_OFF: ControlState.TRANS_TAKEOFF,
    Phase.HOVERING: ControlState.HOVERING,
    Phase.FLYING: ControlState.FLYING,
    Phase.BRAKING: ControlState.TRANS_GOTOFIX,
    Phase.LOOPING: ControlState.TRANS_LOOPING,
    Phase.LANDING: ControlState.TRANS_LANDING,
    Phase.CUT: ControlState.LANDED,
}


def state_word(drone: Quadrotor, control: FlightControl, now_ns: int, bootstrap: bool) -> int:
    """Return the 32 bits of a packet's header for a client that is, or is not, in its bootstrap."""
    autopilot, session = drone.autopilot, control.session
    link = session.link(now_ns)
    word = _ALWAYS
    if control.firmware.generation == 2:
        word |= _CAMERA  # WIRE: on an AR.Drone 1 the bit acknowledges a trim
    if autopilot.motors_on or not drone.airframe.on_ground:
        word |= _FLIES
    if control.start:
        word |= _START
    if session.ack:
        word |= _ACK
    if bootstrap:
        word |= _BOOTSTRAP
    elif control.demo:
        word |= _DEMO
    if drone.battery <= BATTERY_LOW:
        word |= _BATTERY
    if link is not _ALIVE:
        word |= StateBit.COM_WATCHDOG
        if link is CommandLink.LOST:
            word |= StateBit.COM_LOST
    if autopilot.phase is _CUT:
        word |= StateBit.EMERGENCY | (StateBit.CUTOUT if control.cut_out else StateBit.USER_EL)
    return int(word)


def control_state(drone: Quadrotor, control: FlightControl, now_ns: int) -> int:
    """Return flight phase and minor state of the DEMO option."""
    autopilot, minor = drone.autopilot, 0
    phase = autopilot.phase
    if phase is _TAKING_OFF:
        minor = TAKE_OFF_AUTO if drone.airborne else 0
    elif phase is _FLYING:
        minor = FLYING_COMBINED_YAW if control.combined_yaw else 0
    elif phase is _HOVERING:
        if autopilot.calibrating:
            minor = HOVERING_MAGNETO_CALIB
        elif control.session.link(now_ns) is CommandLink.LOST:
            minor = HOVERING_LOST_COM
    return join_control_state(_MAJOR[phase], minor)
