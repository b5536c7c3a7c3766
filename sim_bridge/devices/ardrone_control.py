"""Carries out AT commands on an emulated AR.Drone. No sockets."""

import math

from drivers.ardrone.wire import at
from drivers.ardrone.wire.errors import WireError
from groundstation.time_units import NS_PER_S
from sim_bridge.devices.ardrone_config import Configuration, Ids
from sim_bridge.devices.ardrone_firmware import DEFAULT, FIRMWARES, ArdroneFirmware
from sim_bridge.devices.ardrone_session import COM_LOST_NS, LAND_AFTER_LOST_NS, CommandSession
from sim_bridge.devices.ardrone_subscribers import Audience
from sim_bridge.world.ardrone import Quadrotor
from sim_bridge.world.ardrone_animations import FLIPS, Animation, default_duration_s
from sim_bridge.world.ardrone_autopilot import FlightLimits, MotionReferences, Phase
from sim_bridge.world.ardrone_sensors import Onboard

BATTERY_LOW = 0.20
BATTERY_NO_TAKE_OFF = 0.10
BATTERY_LANDS = 0.05
_MM = 0.001
_COMBINED_YAW_ALLOWED = 1


class FlightControl:
    """Obeys the commands that reach one drone; `blocked`: something holds a propeller (a fault)."""

    def __init__(self, drone: Quadrotor, onboard: Onboard, firmware: ArdroneFirmware = FIRMWARES[DEFAULT]) -> None:
        self.firmware = firmware
        self.configuration = Configuration(firmware)
        self.session = CommandSession()
        self.audience = Audience()
        self.pcmd_sequence = 0
        self.combined_yaw = False
        self.status_wanted = False
        self.dump_wanted = self.custom_dump_wanted = False
        self.start = False
        self.cut_out = False
        self.blocked = False
        self._drone, self._onboard = drone, onboard
        self._select = False
        self._ids: Ids | None = None
        self._apply_limits()

    def obey_datagram(self, datagram: bytes, now_ns: int) -> None:
        """Take one datagram of the AT port."""
        session = self.session
        session.take(now_ns)
        self._ids = None
        for command in at.decode_datagram(datagram):
            if session.accept(command.sequence):
                self._obey(command, now_ns)

    def watch(self, now_ns: int) -> None:
        """React to silence and to an empty battery: hover at 2 s, land half a second later, drop the client."""
        autopilot, session = self._drone.autopilot, self.session
        if self._drone.battery <= BATTERY_LANDS:
            autopilot.land()
        if self.blocked and autopilot.motors_on:
            self.cut_out = True
            autopilot.cut_motors()
        silence = session.silence_ns(now_ns)
        if silence > COM_LOST_NS:
            autopilot.hover()
            if silence > max(COM_LOST_NS, self._watchdog_ns()) + LAND_AFTER_LOST_NS:
                autopilot.land()
            session.forget_silent(now_ns)
            self.audience.forget_silent(now_ns)
            if not len(self.audience):
                session.drop_ack()
        self.audience.leave_bootstrap(now_ns, session.ack)

    @property
    def demo(self) -> bool:
        """Return whether navdata is in demo mode."""
        return self.configuration.flag("general:navdata_demo")

    def _watchdog_ns(self) -> int:
        return self.configuration.integer("general:com_watchdog") * NS_PER_S

    def _obey(self, command: at.AtCommand, now_ns: int) -> None:
        # COMWDG feeds the watchdog like any traffic; MTRIM, PMODE, MISC and the legacy ones change nothing here.
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
                case "FTRIM" if self._drone.autopilot.phase is Phase.LANDED:
                    self._onboard.trim(self._drone.airframe.roll, self._drone.airframe.pitch)
                case "CALIB" if self.firmware.generation == 2 and command.integer(0) == 0:
                    self._drone.autopilot.calibrate()
                case "ANIM":
                    self._animate(f"{command.integer(0)},{command.integer(1)}")
                case "LED":
                    numbers = ",".join(str(command.integer(index)) for index in range(3))
                    self.configuration.write("leds:leds_anim", numbers, self._ids)
        except WireError:
            return  # WIRE: a drone says nothing to a command it cannot read

    def _obey_ref(self, bits: int) -> None:
        # WIRE: never test the base bits; node-ar-drone sends bare 512/256/0 and real drones obey.
        start, select = bool(bits & at.REF_START), bool(bits & at.REF_SELECT)
        autopilot = self._drone.autopilot
        if select and not self._select:
            self._toggle_emergency()
        elif start and not self.start and self._drone.battery > BATTERY_NO_TAKE_OFF:
            autopilot.take_off()
        elif not start:
            autopilot.land()
        self.start, self._select = start, select

    def _toggle_emergency(self) -> None:
        autopilot = self._drone.autopilot
        if autopilot.phase is not Phase.CUT:
            autopilot.cut_motors()
        elif not self.blocked:
            autopilot.clear_emergency()
            self.cut_out = self.cut_out and autopilot.phase is Phase.CUT

    def _obey_motion(self, command: at.AtCommand) -> None:
        motion = at.decode_motion(command)
        self.pcmd_sequence = command.sequence
        autopilot = self._drone.autopilot
        if not motion.flags & at.PCMD_PROGRESSIVE:
            self.combined_yaw = False
            autopilot.hover()
            return
        forward, right = -motion.theta, motion.phi
        if command.name == "PCMD_MAG" and motion.flags & at.PCMD_ABSOLUTE and self.firmware.generation == 2:
            forward, right = self._turned_from_controller(forward, right, motion.psi)
        allowed = self.configuration.integer("control:control_level") & _COMBINED_YAW_ALLOWED
        self.combined_yaw = bool(motion.flags & at.PCMD_COMBINED_YAW and allowed)
        # WIRE: phi > 0 right, theta > 0 backward, yaw > 0 clockwise; the world's axes are forward, left, up.
        limits = autopilot.limits
        autopilot.move(
            MotionReferences(
                right * limits.tilt_rad,
                forward * limits.tilt_rad,
                motion.gaz * limits.climb_m_s,
                -motion.yaw * limits.yaw_rate_rad_s,
                self.combined_yaw,
            )
        )

    def _turned_from_controller(self, forward: float, right: float, psi: float) -> tuple[float, float]:
        """Turn a motion relative to the controller's heading into one relative to the drone's.

        WIRE: psi -1..1 is -180..180 deg clockwise from north; the drone compares it with the heading that it reports.
        """
        clockwise = psi * math.pi + self._onboard.yaw
        c, s = math.cos(clockwise), math.sin(clockwise)
        return c * forward - s * right, s * forward + c * right

    def _obey_config(self, key: str, value: str, now_ns: int) -> None:
        # WIRE: a CONFIG sent while the last one is not acknowledged is lost (node-ar-drone #76).
        if self.session.ack and self.session.answering_config:
            return
        key = key.lower()
        taken = self.configuration.write(key, value, self._ids)
        self._apply_limits()
        self.session.raise_ack(answering_config=True)
        self.status_wanted = True
        if key == "general:navdata_demo":
            self.audience.configured(now_ns)
        elif key == "control:flight_anim" and taken:
            self._animate(value)

    def _animate(self, text: str) -> None:
        """Perform the animation `id,milliseconds`; nonsense, flips on a weak battery or an AR.Drone 1 are ignored."""
        try:
            number, milliseconds = (int(part) for part in text.split(","))
            animation = Animation(number)
        except ValueError:
            return
        self.configuration.write("control:flight_anim", text, self._ids)
        if animation in FLIPS and (self.firmware.generation == 1 or self._drone.battery <= BATTERY_LOW):
            return
        duration_s = min(milliseconds, 60_000) * _MM if milliseconds > 0 else default_duration_s(animation)
        self._drone.autopilot.animate(animation, duration_s)

    def _obey_ctrl(self, mode: int) -> None:
        if mode == at.CTRL_ACK:
            self.status_wanted = self.status_wanted or self.session.ack
            self.session.clear_ack()
        elif mode in (at.CTRL_CONFIG_GET, at.CTRL_CUSTOM_CONFIG_GET):
            self.session.raise_ack(answering_config=False)
            self.dump_wanted = self.dump_wanted or mode == at.CTRL_CONFIG_GET
            self.custom_dump_wanted = self.custom_dump_wanted or mode == at.CTRL_CUSTOM_CONFIG_GET

    def _apply_limits(self) -> None:
        values = self.configuration
        self._drone.ultrasound_code = values.integer("pic:ultrasound_freq")
        self._drone.autopilot.limits = FlightLimits(
            tilt_rad=min(values.real("control:euler_angle_max"), math.radians(30)),
            climb_m_s=values.real("control:control_vz_max") * _MM,
            yaw_rate_rad_s=values.real("control:control_yaw"),
            height_m=values.real("control:altitude_max") * _MM,
        )
