"""ArduCopter 4.6 as a ground station sees it (docs/reference/mavlink.md 1, 5.3)."""

import math

from drivers.mavlink.wire.flight import SetPositionTargetLocalNed
from drivers.mavlink.wire.names import CUSTOM_MODE_ENABLED, Flavour, Landed, MavResult
from drivers.mavlink.wire.names import CopterMode as Mode
from groundstation.vectors import Vector3
from sim_bridge.devices.mavlink_firmware import Answer, AutopilotFirmware
from sim_bridge.devices.mavlink_numbers import byte, whole
from sim_bridge.devices.mavlink_parameters import Parameters
from sim_bridge.devices.mavlink_setpoints import Velocity, Verdict, read_by_ardupilot
from sim_bridge.world.mavlink_copter import MavlinkCopter, Steering

_SPOOL_S = 3.3
_CLIMB_M_S = 0.5
_REACHED_M = 0.08
# Measured after the last pose.
_EKF_FAILSAFE_S = 8.0
_STOPPED_AIDING_S = 15.0
# WIRE (ArduCopter 4.7, mode_land.cpp; seen): a failsafe makes a landing hold its place until so long after it began.
_LANDS_AFTER_S = 4.0
_LEVEL = (Mode.STABILIZE, Mode.ALT_HOLD)
_LANDS = 3  # of FS_THR_ENABLE
# Kinds of speeds: by the air, along the ground, up, down; and their end.
_SPEEDS, _ALONG_GROUND, _NO_SPEED = (0.0, 1.0, 2.0, 3.0), (0.0, 1.0), 4.0
_GCS_ACTIONS = frozenset({1, 3, 5, 7})


class ArduCopter(AutopilotFirmware):
    """GUIDED obeys velocities until GUID_TIMEOUT, and stays GUIDED when it brakes."""

    flavour = Flavour.ARDUPILOT
    guided = Mode.GUIDED
    landing = Mode.LAND
    homeward = Mode.RTL
    arming_refusal = mode_refusal = MavResult.FAILED
    disarmed_text = "Disarming motors"
    place_frames = frozenset({1, 7, 8, 9})

    def __init__(self, copter: MavlinkCopter, parameters: Parameters) -> None:
        super().__init__(copter, parameters, Mode.STABILIZE)
        self._climb_to_m: float | None = None
        self._take_off_s = 0.0
        self._braked = True
        self._paused = False
        self._ground_lost = self._aiding_stopped = False
        self._descends_s: float | None = None
        self._landing_since_s = 0.0
        self._radio_lost = False

    @property
    def hears_transmitter(self) -> bool:
        """WIRE (ArduCopter 4.7, radio.cpp): with FS_THR_ENABLE 0 it never tells that its transmitter was lost."""
        return self.transmitter or (self.received and not self.parameters["FS_THR_ENABLE"])

    def knows(self, mode: int) -> bool:
        """Return whether a mode exists."""
        return mode in list(Mode)

    def arming_fault(self) -> str:
        """Return its reason not to arm now, or ""."""
        fault = self.health_fault()
        if fault:
            return f"Arm: {fault.capitalize()}"
        return "Arm: mode not armable" if self.mode in (Mode.LAND, Mode.RTL, Mode.BRAKE) else ""

    def order_mode(self, params: tuple[float, ...]) -> Answer:
        """Change the mode; WIRE (ArduPilot 4.5, source): only by a custom mode, which is cut to a whole number."""
        if not whole(params[0]) & CUSTOM_MODE_ENABLED:
            return MavResult.DENIED, "no custom mode"
        return self.set_mode(whole(params[1]))

    def set_mode(self, mode: int) -> Answer:
        """Change the mode; those that need a position are refused without one."""
        if not self.knows(mode):
            self.say(4, f"No such mode {mode & 0xFF}")
        needs_position = self.knows(mode) and mode not in (*_LEVEL, Mode.LAND, Mode.GUIDED_NOGPS)
        if needs_position and not self.located:
            self.say(4, f"Mode change to {Mode(mode).name} failed: requires position")
            return MavResult.FAILED, "requires position"
        return super().set_mode(mode)

    def take_off(self, height_m: float) -> Answer:
        """Climb: only armed, on the floor, in GUIDED."""
        if not self.armed or self.mode != Mode.GUIDED or self.copter.airborne or not 0.1 < height_m < 100:
            return MavResult.FAILED, "cannot take off now"
        self._climb_to_m, self._take_off_s = height_m, self.now_s
        return MavResult.ACCEPTED, ""

    def read(self, setpoint: SetPositionTargetLocalNed) -> Velocity | None:
        """Return the velocity of a setpoint; WIRE: an invalid one makes it stop where it is, in GUIDED."""
        if self.mode != Mode.GUIDED:
            return None
        velocity = read_by_ardupilot(setpoint)
        if not isinstance(velocity, Verdict):
            return velocity
        if velocity is Verdict.STOP and self.copter.airborne:
            self.copter.steer(Steering.HOLD)
        return None

    def obey(self, velocity_m_s: tuple[float, float, float], turn: float) -> None:
        """Fly a velocity; it ends a take-off, and does not move a standing or paused vehicle."""
        if self.copter.airborne and not self._paused:
            self._climb_to_m = None
            self._braked = False
            super().obey(velocity_m_s, turn)

    def go(self, place: Vector3, yaw: float | None) -> None:
        """Fly to a place, without a time-out; it ends a take-off, and does not move a standing or paused vehicle."""
        if self.copter.airborne and not self._paused:
            self._climb_to_m = None
            self._braked = True
            super().go(place, yaw)

    def reposition(self, parameters: tuple[float, ...], frame: int | None) -> Answer:
        """Fly to a place in GUIDED; WIRE (ArduCopter 4.7, source): by COMMAND_INT only, its heading is not read."""
        if frame is None:
            return MavResult.UNSUPPORTED, "no frame"
        if self.mode != Mode.GUIDED and not whole(parameters[1]) & 1:
            return MavResult.DENIED, "not in GUIDED"
        latitude, longitude, altitude_m = parameters[4:]
        place = None
        if abs(latitude) <= 90.0 and abs(longitude) <= 180.0 and (latitude or longitude) and math.isfinite(altitude_m):
            place = self.place_on_earth(latitude, longitude, altitude_m, frame)
        if place is None:
            return MavResult.DENIED if self.located else MavResult.FAILED, "no such place"
        answer = self.set_mode(Mode.GUIDED)
        if answer[0] is MavResult.ACCEPTED:
            self.go(place, None)
        return answer

    def turn_to(self, parameters: tuple[float, ...]) -> Answer:
        """Turn to a heading, or by an angle; WIRE (ArduCopter 4.7, source)."""
        degrees, _, direction, relative = parameters[:4]
        if not 0.0 <= degrees <= 360.0 or relative not in (0.0, 1.0):
            return MavResult.FAILED, "no such heading"
        turn = math.radians(degrees)
        yaw = self.copter.estimate.yaw - math.copysign(turn, direction) if relative else -turn
        if self.mode == Mode.GUIDED and self.copter.airborne and not self._paused:
            self._climb_to_m, self._braked = None, True
            self.copter.face(yaw)
        return MavResult.ACCEPTED, ""

    def set_speed(self, parameters: tuple[float, ...]) -> Answer:
        """Take a speed along the ground; WIRE (ArduCopter 4.7, source): only in a mode that has one, as GUIDED."""
        kind, speed_m_s = parameters[:2]
        if not 0.0 < speed_m_s < math.inf or kind == _NO_SPEED:
            return MavResult.DENIED, "no speed"
        if self.mode != Mode.GUIDED or kind not in _SPEEDS:
            return MavResult.FAILED, "not now"
        if kind in _ALONG_GROUND:
            self.copter.fastest_m_s = speed_m_s
        return MavResult.ACCEPTED, ""

    def pause(self, order: float) -> Answer:
        """Hover in GUIDED until the mode is entered anew; WIRE (docs/reference/mavlink.md 5.11)."""
        if byte(order) > 1:
            return MavResult.DENIED, "neither pause nor resume"
        if self.mode != Mode.GUIDED:
            return MavResult.FAILED, "not in GUIDED"
        self._paused = byte(order) == 0
        if self._paused and self.copter.airborne:
            self.copter.steer(Steering.HOLD)
        return MavResult.ACCEPTED, ""

    def enter(self, mode: int) -> None:
        """Change the mode; a take-off belongs to GUIDED."""
        if mode != Mode.GUIDED:
            self._climb_to_m = None
            self._paused = False
        self._descends_s = None
        if mode != self.mode:
            self._landing_since_s = self.now_s
        super().enter(mode)

    def _fail_safe(self) -> None:
        if self.mode != Mode.LAND:
            self.enter(Mode.LAND)
        until_s = self._landing_since_s + _LANDS_AFTER_S
        if self.now_s < until_s:
            self._descends_s = until_s
            self.copter.steer(Steering.HOLD)

    def step(self, now_s: float, ground_silence_s: float) -> None:
        """Climb when asked to, then watch over time-outs."""
        super().step(now_s, ground_silence_s)
        if self.armed and self._climb_to_m is not None and now_s - self._take_off_s >= _SPOOL_S:
            if self.copter.estimate.position[2] < self._climb_to_m - _REACHED_M:
                self.copter.fly((0.0, 0.0, _CLIMB_M_S), 0.0)
            else:
                self._climb_to_m = None
                self.copter.steer(Steering.HOLD)

    @property
    def landed(self) -> Landed:
        """Return the landing state; WIRE (docs/reference/mavlink.md 1): 3 until the height is reached."""
        climbing = self._climb_to_m is not None and self.armed and self.now_s - self._take_off_s >= _SPOOL_S
        return Landed.TAKE_OFF if climbing else super().landed

    def steering_of(self, mode: int) -> Steering:
        """Return the motors' action for a mode, in the air."""
        return Steering.LEVEL if mode in _LEVEL else Steering.HOLD

    def watch(self, ground_silence_s: float) -> None:
        """Brake when setpoints stop; land when the ground or the position is lost."""
        if self.mode == Mode.GUIDED and not self._braked and self.setpoint_age_s > self.parameters["GUID_TIMEOUT"]:
            self._braked = True
            self.copter.fly((0.0, 0.0, 0.0), 0.0)
        if ground_silence_s > self.parameters["FS_GCS_TIMEOUT"] and self.parameters["FS_GCS_ENABLE"] in _GCS_ACTIONS:
            if not self._ground_lost:
                self._ground_lost = True
                self.say(4, "GCS Failsafe")
                self._fail_safe()
        elif self._ground_lost:
            self._ground_lost = False
            self.say(4, "GCS Failsafe Cleared")
        self._watch_transmitter()
        self._watch_position(self.copter.estimate.aided_s)
        if self._descends_s is not None and self.now_s >= self._descends_s:
            self._descends_s = None
            self.copter.steer(Steering.LAND)

    def _watch_transmitter(self) -> None:
        if self.received and not self.hears_transmitter and not self._radio_lost:
            self.say(4, "Radio Failsafe")
            self._fail_safe() if self.parameters["FS_THR_ENABLE"] == _LANDS else self.enter(Mode.RTL)
        self._radio_lost = self.received and not self.hears_transmitter

    def _watch_position(self, aided_s: float) -> None:
        if aided_s < _EKF_FAILSAFE_S:
            self._failed = self._aiding_stopped = False
        elif not self._failed and self.parameters["FS_EKF_THRESH"] > 0:
            self._failed = True
            self.say(2, "EKF variance")
            self.say(2, "EKF Failsafe" if self.mode == Mode.LAND else "EKF Failsafe: changed to LAND Mode")
            if self.mode != Mode.LAND:  # source (ekf_check.cpp): a landing only goes on without a position
                self._fail_safe()
        elif aided_s > _STOPPED_AIDING_S and not self._aiding_stopped:
            self._aiding_stopped = True
            self.say(4, "EKF3 IMU0 stopped aiding")

    def disarm_after_s(self) -> float:
        """Return the time on the floor after which the motors stop [s]."""
        return 1.0 if self.mode == Mode.LAND else self.parameters["DISARM_DELAY"]
