"""The parts that both emulated autopilots share: arming, mode, setpoints, landing, telemetry. No sockets.

Times are seconds of the world. Setpoints arrive in MAVLink's frames and are turned into the world's here, by this
file's own signs.
"""

import math
from collections import deque

from drivers.mavlink.wire.flight import SetPositionTargetGlobalInt, SetPositionTargetLocalNed
from drivers.mavlink.wire.names import FORCE, Flavour, Landed, MavResult, MavState
from groundstation.vectors import Vector3
from sim_bridge.devices.mavlink_parameters import Parameters
from sim_bridge.devices.mavlink_places import as_local, heading_of, height_in, local_place, on_ground
from sim_bridge.devices.mavlink_satellites import Satellites
from sim_bridge.devices.mavlink_setpoints import Velocity
from sim_bridge.world.airframe import STANDING_HEIGHT_M
from sim_bridge.world.mavlink_copter import MavlinkCopter, Steering

Answer = tuple[MavResult, str]
_YAW_GAIN = 2.0
_AIDED_S = 1.0
_BATTERY_MIN = 0.15
_OK: Answer = (MavResult.ACCEPTED, "")


class AutopilotFirmware:
    """One autopilot around a body of the world, with overrides by flavour. texts: (severity, line) to send.

    transmitter: it receives a pilot's; received: it has done so since its start.
    """

    flavour: Flavour
    guided: int
    landing: int
    homeward: int

    def __init__(self, copter: MavlinkCopter, parameters: Parameters, start_mode: int) -> None:
        self.copter, self.parameters = copter, parameters
        self.armed = self.transmitter = self.received = False
        self.mode = start_mode
        self.texts: deque[tuple[int, str]] = deque(maxlen=32)
        self.origin: tuple[int, int, int] | None = None
        self.satellites: Satellites | None = None
        self.now_s = 0.0
        self._setpoint_s = -math.inf
        self._stream_s = 0.0
        self._armed_s = self._grounded_s = 0.0
        self._failed = False

    # -- requests -----------------------------------------------------------------------------------------------------

    def arm(self, force: bool = False) -> Answer:
        """Start the motors, unless something forbids it."""
        if self.armed:
            return _OK
        fault = "" if force else self.arming_fault()
        if fault:
            self.say(2, fault)
            return self.arming_refusal, fault
        self.armed, self._armed_s, self._grounded_s, self._failed = True, self.now_s, self.now_s, False
        self.copter.steer(Steering.IDLE)
        return _OK

    def disarm(self, code: float) -> Answer:
        """Stop the motors; in the air only by force."""
        if self.copter.airborne and code != FORCE:
            return self.arming_refusal, "not landed"
        self.armed = False
        self.copter.steer(Steering.OFF)
        return _OK

    def order_mode(self, params: tuple[float, ...]) -> Answer:
        """Change the mode by the parameters of DO_SET_MODE: base mode, then the mode as the flavour writes it."""
        raise NotImplementedError

    def set_mode(self, mode: int) -> Answer:
        """Change the mode on request."""
        if not self.knows(mode):
            return self.mode_refusal, f"mode {mode:#x} unknown"
        self.enter(mode)
        return _OK

    def land(self) -> Answer:
        """Land here."""
        self.enter(self.landing)
        return _OK

    def go_home(self) -> Answer:
        """Fly home by itself, to land there."""
        return self.set_mode(self.homeward)

    def take_off(self, height_m: float) -> Answer:
        """Climb to a height above the floor."""
        raise NotImplementedError

    def reposition(self, parameters: tuple[float, ...], frame: int | None) -> Answer:
        """Fly to a place; parameters: the seven of DO_REPOSITION; frame: of a COMMAND_INT, None of a COMMAND_LONG."""
        raise NotImplementedError

    def turn_to(self, parameters: tuple[float, ...]) -> Answer:
        """Turn to a heading; parameters: the seven of CONDITION_YAW."""
        return MavResult.UNSUPPORTED, ""

    def set_speed(self, parameters: tuple[float, ...]) -> Answer:
        """Take the speed of ways to places; parameters: the seven of DO_CHANGE_SPEED."""
        raise NotImplementedError

    def pause(self, order: float) -> Answer:
        """Pause the mode's motion, 0, or resume it, 1."""
        return MavResult.UNSUPPORTED, ""

    def fly(self, setpoint: SetPositionTargetLocalNed) -> None:
        """Take a setpoint."""
        velocity = self.read(setpoint)
        if velocity is None:
            return
        if self.now_s - self._setpoint_s > 0.5:
            self._stream_s = self.now_s
        self._setpoint_s = self.now_s
        if not self.armed or self.mode != self.guided:
            return
        place = local_place(setpoint, self.copter.estimate.position, self.copter.estimate.yaw)
        if place is None or setpoint.coordinate_frame not in self.place_frames:
            self.obey(self._velocity(velocity, setpoint.coordinate_frame), self._turn(setpoint))
        else:
            self.go(place, heading_of(setpoint))

    def fly_on_earth(self, setpoint: SetPositionTargetGlobalInt) -> None:
        """Take a setpoint at a place on Earth, which counts only where the vehicle knows its own."""
        local = self.origin and self.located and as_local(setpoint, self.origin, self._home_z_m)
        if local:
            self.fly(local)

    def place_on_earth(self, latitude: float, longitude: float, altitude_m: float, frame: int) -> Vector3 | None:
        """Return a place [deg, m] in the world, None without an origin, numbers, or a frame with an altitude."""
        numbers = all(map(math.isfinite, (latitude, longitude, altitude_m)))
        if self.origin is None or not self.located or not numbers:
            return None
        z = height_in(frame, self.origin, self._home_z_m, altitude_m)
        return None if z is None else (*on_ground(self.origin, latitude, longitude), z)

    @property
    def _home_z_m(self) -> float:
        return STANDING_HEIGHT_M if self.satellites is not None else 0.0

    def read(self, setpoint: SetPositionTargetLocalNed) -> Velocity | None:
        """Return the velocity of a setpoint [its own frame]; one without is answered here, with a text or a stop."""
        raise NotImplementedError

    def _velocity(self, velocity: Velocity, frame: int) -> Velocity:
        # North-east-down or forward-right-down to the heading frame's forward-left-up.
        first, second, up = velocity[0], -velocity[1], -velocity[2]
        if frame in (8, 9):
            return first, second, up
        c, s = math.cos(self.copter.estimate.yaw), math.sin(self.copter.estimate.yaw)
        return c * first + s * second, c * second - s * first, up

    def _turn(self, setpoint: SetPositionTargetLocalNed) -> float:
        mask = setpoint.type_mask
        if not mask & 2048 and math.isfinite(setpoint.yaw_rate):
            return -setpoint.yaw_rate
        if not mask & 1024 and math.isfinite(setpoint.yaw):
            return _YAW_GAIN * math.remainder(-setpoint.yaw - self.copter.estimate.yaw, math.tau)
        return 0.0

    # -- without a request ---------------------------------------------------------------------------------------------

    def obey(self, velocity_m_s: tuple[float, float, float], turn: float) -> None:
        """Fly a velocity [heading frame, FLU]."""
        self.copter.fly(velocity_m_s, turn)

    def go(self, place: Vector3, yaw: float | None) -> None:
        """Fly to a place [world], and turn to a heading, None: keep it."""
        self.copter.go(place, yaw)

    def enter(self, mode: int) -> None:
        """Change the mode."""
        if mode != self.mode:
            self.mode = mode
            if self.armed and self.copter.airborne:
                self.copter.steer(Steering.LAND if mode == self.landing else self.steering_of(mode))

    def step(self, now_s: float, ground_silence_s: float) -> None:
        """Watch over time-outs; call it once per tick."""
        self.now_s = now_s
        self.received = self.received or self.transmitter
        if self.global_position and self.satellites is not None:
            self.satellites.aid(self.copter)
        if not self.armed:
            return
        if self.copter.airborne:
            self._grounded_s = now_s
            self.watch(ground_silence_s)
        elif now_s - self._grounded_s > self.disarm_after_s():
            self.say(6, self.disarmed_text)
            self.disarm(0.0)

    def say(self, severity: int, text: str) -> None:
        """Send a line to the operator."""
        self.texts.append((severity, text))

    @property
    def landed(self) -> Landed:
        """Return the state of the landing detector."""
        if not self.copter.airborne:
            return Landed.ON_GROUND
        return Landed.LANDING if self.mode == self.landing else Landed.IN_AIR

    @property
    def setpoint_age_s(self) -> float:
        """Return the time since the last good setpoint."""
        return self.now_s - self._setpoint_s

    @property
    def streams(self) -> bool:
        """Return whether setpoints have kept coming for a second."""
        return self.setpoint_age_s < 0.5 and self.now_s - self._stream_s >= 1.0

    @property
    def hears_transmitter(self) -> bool:
        """Return whether it says that it receives a transmitter."""
        return self.transmitter

    @property
    def located(self) -> bool:
        """Return whether the estimator has a position now."""
        return self.copter.estimate.has_position and self.copter.estimate.aided_s < _AIDED_S

    @property
    def global_position(self) -> bool:
        """Return whether it has a position by satellites."""
        return self.satellites is not None and not self.parameters.indoor

    def equip(self, satellites: Satellites) -> None:
        """Give it a satellite receiver; its parameters say whether the filter uses it."""
        self.satellites = satellites
        if self.global_position:
            self.origin = satellites.origin

    def health_fault(self) -> str:
        """Return the reason against arming in any mode, or ""."""
        if not self.parameters.indoor and self.satellites is None:
            return "no GPS"
        if not self.located:
            return "need position estimate"
        return "battery low" if self.copter.battery < _BATTERY_MIN else ""

    @property
    def passes_checks(self) -> bool:
        """Return whether it says that it may be armed."""
        return not self.health_fault()

    def state(self, armed: bool, airborne: bool) -> int:
        """Return its MAV_STATE: standing by, or active in the air."""
        return MavState.ACTIVE if airborne else MavState.STANDBY

    # -- flavours -----------------------------------------------------------------------------------------------------

    # WIRE (PX4 1.15, ArduPilot 4.5, source): each has one answer to all that it refuses.
    arming_refusal = mode_refusal = MavResult.TEMPORARILY_REJECTED
    disarmed_text = "Disarmed"
    # Frames of setpoints in which it reads a place.
    place_frames: frozenset[int]

    def arming_fault(self) -> str:
        """Return its reason not to arm now, in its own words, or ""."""
        raise NotImplementedError

    def knows(self, mode: int) -> bool:
        """Return whether a mode exists."""
        raise NotImplementedError

    def steering_of(self, mode: int) -> Steering:
        """Return the motors' action for a mode, in the air."""
        raise NotImplementedError

    def watch(self, ground_silence_s: float) -> None:
        """React to silence of setpoints, ground station or cameras."""
        raise NotImplementedError

    def disarm_after_s(self) -> float:
        """Return the time on the floor after which the motors stop [s]."""
        raise NotImplementedError
