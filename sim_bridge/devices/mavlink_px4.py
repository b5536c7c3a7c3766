"""PX4 1.16 as a ground station sees it (docs/reference/mavlink.md 2, 5.2)."""

import math

from drivers.mavlink.wire.flight import SetPositionTargetLocalNed
from drivers.mavlink.wire.names import Flavour, MavResult, MavState, Px4Auto, Px4Main, px4_mode
from groundstation.vectors import Vector3
from sim_bridge.devices.mavlink_firmware import Answer, AutopilotFirmware
from sim_bridge.devices.mavlink_numbers import byte
from sim_bridge.devices.mavlink_parameters import Parameters
from sim_bridge.devices.mavlink_setpoints import Velocity, read_by_px4
from sim_bridge.world.mavlink_copter import GO_M_S, MavlinkCopter, Steering

HOLD = px4_mode(Px4Main.AUTO, Px4Auto.HOLD)
TAKE_OFF = px4_mode(Px4Main.AUTO, Px4Auto.TAKE_OFF)
LAND = px4_mode(Px4Main.AUTO, Px4Auto.LAND)
OFFBOARD = px4_mode(Px4Main.OFFBOARD)
POSITION = px4_mode(Px4Main.POSITION)
ALTITUDE = px4_mode(Px4Main.ALTITUDE)
# Measured: 1.42 s for COM_OF_LOSS_T 1.0; lost vision 4.8 to 5.6 s for EKF2_NOAID_TOUT 5 s, 1 s for 0.9 s.
_GRANULARITY_S, _NOTICED_S = 0.42, 0.1
_SPOOL_S = 1.0
_CLIMB_M_S, _REACHED_M, _LIFTS_M = 1.0, 0.1, 0.2
_LOSS_MODES = {0: POSITION, 1: ALTITUDE, 2: px4_mode(Px4Main.STABILIZED), 4: LAND, 5: HOLD}
_LEVEL = (ALTITUDE, px4_mode(Px4Main.STABILIZED), px4_mode(Px4Main.MANUAL), px4_mode(Px4Main.ACRO))
MISSION = px4_mode(Px4Main.AUTO, Px4Auto.MISSION)
RETURN = px4_mode(Px4Main.AUTO, Px4Auto.RETURN)
# With the modes of companion computers.
_AUTO_MODES = frozenset(Px4Auto) | frozenset(range(11, 19))
_NAMES = {
    POSITION: "Position", ALTITUDE: "Altitude", px4_mode(Px4Main.STABILIZED): "Stabilized", MISSION: "Mission",
    OFFBOARD: "Offboard", HOLD: "Hold", RETURN: "Return", TAKE_OFF: "Takeoff",
}  # fmt: skip
# MAV_MODE_FLAG.
_CUSTOM, _AUTO, _GUIDED, _STABILIZE, _MANUAL = 1, 4, 8, 16, 64
# Measured: what a return does at once; its height is that of RTL_RETURN_ALT on a small field.
_RETURN_M_S, _RETURN_M = 1.1, 5.0
_UNFIT = "Arming denied: Resolve system health failures first"


class Px4(AutopilotFirmware):
    """OFFBOARD needs a stream of setpoints to arm and to stay in."""

    flavour = Flavour.PX4
    guided = OFFBOARD
    landing = LAND
    homeward = RETURN
    disarmed_text = "Disarmed by landing"
    place_frames = frozenset({1})

    def __init__(self, copter: MavlinkCopter, parameters: Parameters) -> None:
        super().__init__(copter, parameters, HOLD)
        self._climb_to_m: float | None = None
        self._before_landing = HOLD

    @property
    def has_global_position(self) -> bool:
        """Return whether it knows its place on the globe.

        WIRE (PX4 1.16): an origin makes one of our positions, and so HOLD, RETURN and TAKE_OFF possible indoors.
        """
        return self.global_position or (self.origin is not None and self.located)

    def knows(self, mode: int) -> bool:
        """Return whether a mode exists."""
        main, sub = mode >> 16 & 0xFF, mode >> 24
        return sub in _AUTO_MODES if main == Px4Main.AUTO else main in frozenset(Px4Main)

    def arming_fault(self) -> str:
        """Return its reason not to arm now, or ""; WIRE (PX4 1.16): it names no missing setpoints."""
        fault = self.health_fault()
        if fault:
            return f"Arming denied: {fault}"
        return "" if (self.streams if self.mode == OFFBOARD else self.has_global_position) else _UNFIT

    def disarm(self, code: float) -> Answer:
        """Stop the motors; WIRE (PX4 1.16): after a landing it is in the mode of before again."""
        answer = super().disarm(code)
        if not self.armed and self.mode in (LAND, RETURN):
            self.mode = self._before_landing
        return answer

    def land(self) -> Answer:
        """Land here, aloud."""
        self.say(6, "Landing at current position")
        return super().land()

    def take_off(self, height_m: float) -> Answer:
        """Climb in AUTO.TAKEOFF, then hold; WIRE (PX4 1.16): taken in flight as well, and without a global position
        refused only then.

        height_m: above sea level, as the command says; 0: MIS_TAKEOFF_ALT above the floor.
        """
        answer = self.set_mode(TAKE_OFF)
        if answer[0] is MavResult.ACCEPTED and height_m and self.satellites is not None:
            self._climb_to_m = self.satellites.height_of(height_m)
        return answer

    def order_mode(self, params: tuple[float, ...]) -> Answer:
        """Change the mode by base mode, main mode and sub-mode.

        WIRE (PX4 1.16): a main mode that does not exist is accepted, and changes nothing; so is a base mode that names
        none. Without a custom mode the flags of the base mode count (source).
        """
        base, main, sub = map(byte, params[:3])
        if not base & _CUSTOM:
            wanted = _by_flags(base)
        elif main == Px4Main.AUTO and sub and sub not in _AUTO_MODES:
            self.say(2, "Unsupported auto mode")
            return self.mode_refusal, "no such mode"
        elif main == Px4Main.AUTO:
            wanted = px4_mode(main, sub or Px4Auto.MISSION)
        else:
            wanted = px4_mode(main) if main in frozenset(Px4Main) else None
        return (MavResult.ACCEPTED, "") if wanted is None else self.set_mode(wanted)

    def set_mode(self, mode: int) -> Answer:
        """Change the mode on request.

        WIRE (docs/reference/mavlink.md 5.2): once armed, OFFBOARD is refused unless setpoints keep coming, and so is
        each mode whose needs it has not.
        """
        if self.armed and self.knows(mode) and not self._can_fly(mode):
            if name := _NAMES.get(mode, ""):
                self.say(2, f"Switching to {name} is currently not available")
            return MavResult.TEMPORARILY_REJECTED, "not available"
        self._failed = False
        return super().set_mode(mode)

    def _can_fly(self, mode: int) -> bool:
        if mode == OFFBOARD:
            return self.setpoint_age_s <= self.parameters["COM_OF_LOSS_T"]
        if mode == POSITION or mode in _LEVEL:
            return self.transmitter
        if mode in (HOLD, RETURN, TAKE_OFF):
            return self.has_global_position
        return mode != MISSION  # there is none

    def reposition(self, parameters: tuple[float, ...], frame: int | None) -> Answer:
        """Enter HOLD and fly to a place, or stop here if none is named: QGroundControl's Pause.

        WIRE (docs/reference/mavlink.md 5.11; main of June 2025, source): only with the flag of a change of mode and no
        other. What is no number stays as it is; the altitude is above the sea in any frame, the heading in radians.
        """
        if parameters[1] != 1.0:
            return MavResult.UNSUPPORTED, ""
        answer = self.set_mode(HOLD)
        if answer[0] is MavResult.ACCEPTED and self.armed and self.copter.airborne and self.origin is not None:
            self._go_on_earth(*parameters[3:])
        return answer

    def set_speed(self, parameters: tuple[float, ...]) -> Answer:
        """Take a speed; WIRE (main of June 2025, source): always accepted, none is the default."""
        self.copter.fastest_m_s = parameters[1] if 0.0 < parameters[1] < math.inf else GO_M_S
        return MavResult.ACCEPTED, ""

    def _go_on_earth(self, yaw: float, latitude: float, longitude: float, altitude_m: float) -> None:
        if not any(map(math.isfinite, (yaw, latitude, longitude, altitude_m))):
            self.copter.steer(Steering.HOLD)
            return
        here, named = self.copter.estimate.position, math.isfinite(latitude) and math.isfinite(longitude)
        assert self.origin is not None
        at_sea = self.origin[2] * 1e-3
        degrees = (latitude, longitude) if named else (self.origin[0] * 1e-7, self.origin[1] * 1e-7)
        place = self.place_on_earth(*degrees, altitude_m if math.isfinite(altitude_m) else at_sea, 0)
        if place is not None:
            x, y = place[:2] if named else here[:2]
            self.go((x, y, place[2] if math.isfinite(altitude_m) else here[2]), -yaw if math.isfinite(yaw) else None)

    def enter(self, mode: int) -> None:
        """Change the mode, which ends a take-off; AUTO.TAKEOFF without a height climbs to that of the parameter."""
        self._climb_to_m = self.parameters["MIS_TAKEOFF_ALT"] if mode == TAKE_OFF else None
        if mode not in (LAND, RETURN):
            self._before_landing = mode
        super().enter(mode)

    def step(self, now_s: float, ground_silence_s: float) -> None:
        """Climb when asked to, then watch over time-outs."""
        super().step(now_s, ground_silence_s)
        if self.armed and self.mode == RETURN and self.copter.airborne:
            climbs = self.copter.estimate.position[2] < _RETURN_M
            self.copter.fly((0.0, 0.0, _RETURN_M_S if climbs else 0.0), 0.0)
        if not self.armed or self._climb_to_m is None or now_s - self._armed_s < _SPOOL_S:
            return
        if self.copter.estimate.position[2] < self._climb_to_m - _REACHED_M:
            self.copter.fly((0.0, 0.0, _CLIMB_M_S), 0.0)
        else:
            self.enter(HOLD)

    def read(self, setpoint: SetPositionTargetLocalNed) -> Velocity | None:
        """Return the velocity of a setpoint; WIRE (docs/reference/mavlink.md 5.1): one without is refused aloud."""
        velocity = read_by_px4(setpoint)
        if isinstance(velocity, str):
            self.say(2, velocity)
            return None
        return velocity

    def obey(self, velocity_m_s: tuple[float, float, float], turn: float) -> None:
        """Fly, once the propellers are up to speed."""
        if self.now_s - self._armed_s >= _SPOOL_S:
            if not self.copter.airborne and velocity_m_s[2] > 0.05:
                self.say(6, "Takeoff detected")
            super().obey(velocity_m_s, turn)

    def go(self, place: Vector3, yaw: float | None) -> None:
        """Fly to a place, once the propellers are up to speed; from the floor only up."""
        if self.copter.airborne:
            super().go(place, yaw)
        elif place[2] > self.copter.estimate.position[2] + _LIFTS_M and self.now_s - self._armed_s >= _SPOOL_S:
            self.say(6, "Takeoff detected")
            super().go(place, yaw)

    def steering_of(self, mode: int) -> Steering:
        """Return the motors' action for a mode, in the air."""
        if mode == OFFBOARD:
            return Steering.VELOCITY
        return Steering.LEVEL if mode in _LEVEL else Steering.HOLD

    def watch(self, ground_silence_s: float) -> None:
        """Leave OFFBOARD when setpoints stop; level out when the position is lost."""
        if self.mode == OFFBOARD and self.setpoint_age_s > self.parameters["COM_OF_LOSS_T"] + _GRANULARITY_S:
            self._fail(_LOSS_MODES.get(int(self.parameters["COM_OBL_RC_ACT"]), POSITION))
        unaided_s = self.parameters["EKF2_NOAID_TOUT"] * 1e-6 + _NOTICED_S
        if self.copter.estimate.aided_s > unaided_s and self.mode not in (*_LEVEL, LAND):
            # WIRE (docs/decisions/0168): OFFBOARD without a velocity is lost OFFBOARD; LAND then descends level.
            lands = self.mode == OFFBOARD and self.parameters["COM_OBL_RC_ACT"] == 4
            self._fail(LAND if lands else ALTITUDE)
        silent = ground_silence_s > self.parameters["COM_DL_LOSS_T"]
        if silent and self.parameters["NAV_DLL_ACT"] == 3 and self.mode != LAND:
            self._fail(LAND)

    def _fail(self, mode: int) -> None:
        self.say(2, "Failsafe activated")
        self.enter(mode)
        self._failed = True

    @property
    def passes_checks(self) -> bool:
        """WIRE (PX4 1.16): PREARM_CHECK is healthy indoors, once an origin was set."""
        return self.has_global_position and super().passes_checks

    def state(self, armed: bool, airborne: bool) -> int:
        """WIRE (PX4 1.16): active from arming on, critical in a failsafe, and before its checks pass none of them."""
        if armed:
            return MavState.CRITICAL if self._failed else MavState.ACTIVE
        return MavState.UNINIT if self.arming_fault() else MavState.STANDBY

    def disarm_after_s(self) -> float:
        """Return the time on the floor after which the motors stop [s]."""
        return self.parameters["COM_DISARM_LAND" if self.mode == LAND else "COM_DISARM_PRFLT"]


def _by_flags(base: int) -> int | None:
    if base & _AUTO:
        return px4_mode(Px4Main.AUTO, Px4Auto.MISSION)
    if not base & _MANUAL:
        return None
    if base & _GUIDED:
        return POSITION
    return px4_mode(Px4Main.STABILIZED if base & _STABILIZE else Px4Main.MANUAL)
