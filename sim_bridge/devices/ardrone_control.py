"""What AT commands do to an emulated AR.Drone, and what its state word and control state say of it. No sockets."""

import math

from drivers.ardrone.wire import at
from drivers.ardrone.wire.errors import WireError
from drivers.ardrone.wire.state import HEALTHY, HOVERING_LOST_COM, ControlState, StateBit, join_control_state
from sim_bridge.devices.ardrone_config import Configuration, Ids
from sim_bridge.devices.ardrone_session import COM_LOST_NS, LAND_AFTER_LOST_NS, Link, Session
from sim_bridge.world.autopilot import FlightLimits, Motion, Phase
from sim_bridge.world.quadrotor import Quadrotor

BATTERY_LOW = 0.20
BATTERY_NO_TAKE_OFF = 0.10
BATTERY_LANDS = 0.05
_MM = 0.001

_MAJOR = {
    Phase.LANDED: ControlState.LANDED,
    Phase.TAKING_OFF: ControlState.TRANS_TAKEOFF,
    Phase.HOVERING: ControlState.HOVERING,
    Phase.FLYING: ControlState.FLYING,
    Phase.BRAKING: ControlState.TRANS_GOTOFIX,
    Phase.LANDING: ControlState.TRANS_LANDING,
    Phase.CUT: ControlState.LANDED,
}


class FlightControl:
    """Obeys the commands of one session."""

    def __init__(self, drone: Quadrotor) -> None:
        self.configuration = Configuration()
        self.session = Session()
        self.pcmd_sequence = 0
        self.status_wanted = False
        self._drone = drone
        self._start = False
        self._select = False
        self._ids: Ids | None = None
        self._apply_limits()

    def obey_datagram(self, datagram: bytes, now_ns: int) -> None:
        """Take one datagram of the AT port."""
        session = self.session
        session.hear(now_ns)
        self._ids = None
        for command in at.decode_datagram(datagram):
            if session.accept(command.sequence):
                self._obey(command, now_ns)

    def watch(self, now_ns: int) -> None:
        """Do what silence, and an empty battery, ask for: hover at 2 s, land a second later, forget the client."""
        autopilot = self._drone.autopilot
        if self._drone.battery <= BATTERY_LANDS:
            autopilot.land()
        silence = self.session.silence_ns(now_ns)
        if silence > COM_LOST_NS:
            autopilot.hover()
            if silence > max(COM_LOST_NS, self._watchdog_ns()) + LAND_AFTER_LOST_NS:
                autopilot.land()
            self.session.forget_silent(now_ns)
        self.session.leave_bootstrap(now_ns)

    def state_word(self, now_ns: int) -> int:
        """Return the 32 bits of every packet's header."""
        autopilot, session, link = self._drone.autopilot, self.session, self.session.link(now_ns)
        cut = autopilot.phase is Phase.CUT
        bits = (
            (StateBit.FLY, autopilot.motors_on or self._drone.airborne),
            (StateBit.USER_FEEDBACK_START, self._start),
            (StateBit.COMMAND, session.ack),
            (StateBit.NAVDATA_DEMO, not session.bootstrap and self.configuration.flag("general:navdata_demo")),
            (StateBit.NAVDATA_BOOTSTRAP, session.bootstrap),
            (StateBit.COM_LOST, link is Link.LOST),
            (StateBit.VBAT_LOW, self._drone.battery <= BATTERY_LOW),
            (StateBit.USER_EL, cut),
            (StateBit.COM_WATCHDOG, link is not Link.ALIVE),
            (StateBit.EMERGENCY, cut),
        )
        word = HEALTHY | StateBit.ALTITUDE | StateBit.CAMERA
        for bit, is_set in bits:
            word |= bit if is_set else 0
        return word

    def control_state(self, now_ns: int) -> int:
        """Return flight phase and minor state of the DEMO option."""
        phase = self._drone.autopilot.phase
        minor = 0
        if phase is Phase.TAKING_OFF and self._drone.airborne:
            minor = 1
        elif phase is Phase.HOVERING and self.session.link(now_ns) is Link.LOST:
            minor = HOVERING_LOST_COM
        return join_control_state(_MAJOR[phase], minor)

    def _watchdog_ns(self) -> int:
        return self.configuration.integer("general:com_watchdog") * 1_000_000_000

    def _obey(self, command: at.AtCommand, now_ns: int) -> None:
        # FTRIM, CALIB, LED, ANIM, PMODE, MISC and the legacy ones are accepted and change nothing here.
        try:
            match command.name:
                case "REF":
                    self._obey_ref(command.integer(0))
                case "PCMD" | "PCMD_MAG":
                    self._obey_motion(command)
                case "CONFIG":
                    self._obey_config(command.text(0), command.text(1), now_ns)
                case "CONFIG_IDS":
                    self._ids = (command.text(0), command.text(1), command.text(2))
                case "CTRL":
                    self._obey_ctrl(command.integer(0))
        except WireError:
            return  # WIRE: a drone says nothing to a command it cannot read

    def _obey_ref(self, bits: int) -> None:
        # WIRE: never test the base bits; node-ar-drone sends bare 512/256/0 and real drones obey.
        start, select = bool(bits & at.REF_START), bool(bits & at.REF_SELECT)
        autopilot = self._drone.autopilot
        if select and not self._select:
            if autopilot.phase is Phase.CUT:
                autopilot.clear_emergency()
            else:
                autopilot.cut_motors()
        elif start and not self._start and self._drone.battery > BATTERY_NO_TAKE_OFF:
            autopilot.take_off()
        elif not start:
            autopilot.land()
        self._start, self._select = start, select

    def _obey_motion(self, command: at.AtCommand) -> None:
        motion = at.decode_motion(command)
        self.pcmd_sequence = command.sequence
        autopilot = self._drone.autopilot
        if not motion.flags & at.PCMD_PROGRESSIVE:
            autopilot.hover()
            return
        # WIRE: phi > 0 right, theta > 0 backward, yaw > 0 clockwise; the world's axes are forward, left, up.
        limits = autopilot.limits
        autopilot.move(
            Motion(
                motion.phi * limits.tilt_rad,
                -motion.theta * limits.tilt_rad,
                motion.gaz * limits.climb_m_s,
                -motion.yaw * limits.yaw_rate_rad_s,
            )
        )

    def _obey_config(self, key: str, value: str, now_ns: int) -> None:
        # WIRE: a CONFIG sent while the last one is not acknowledged is lost (node-ar-drone #76).
        if self.session.ack:
            return
        self.configuration.write(key, value, self._ids)
        self._apply_limits()
        self.session.raise_ack()
        self.status_wanted = True
        if key.lower() == "general:navdata_demo":
            self.session.configured(now_ns)

    def _obey_ctrl(self, mode: int) -> None:
        if mode == at.CTRL_ACK:
            self.session.clear_ack()
        elif mode in (at.CTRL_CONFIG_GET, at.CTRL_CUSTOM_CONFIG_GET):
            self.session.raise_ack()

    def _apply_limits(self) -> None:
        values = self.configuration
        self._drone.autopilot.limits = FlightLimits(
            tilt_rad=min(values.real("control:euler_angle_max"), math.radians(30)),
            climb_m_s=values.real("control:control_vz_max") * _MM,
            yaw_rate_rad_s=values.real("control:control_yaw"),
            height_m=values.real("control:altitude_max") * _MM,
        )
