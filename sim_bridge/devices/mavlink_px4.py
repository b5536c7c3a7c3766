"""PX4 1.16 as a ground station sees it (docs/reference/mavlink.md 2, 5.2)."""

import math

from drivers.mavlink.wire.flight import SetPositionTargetLocalNed
from drivers.mavlink.wire.names import Flavour, MavResult, Px4Auto, Px4Main, px4_mode
from sim_bridge.devices.mavlink_firmware import Answer, AutopilotFirmware
from sim_bridge.devices.mavlink_numbers import byte
from sim_bridge.devices.mavlink_parameters import Parameters
from sim_bridge.devices.mavlink_setpoints import Velocity, read_by_px4
from sim_bridge.world.mavlink_copter import MavlinkCopter, Steering

HOLD = px4_mode(Px4Main.AUTO, Px4Auto.HOLD)
TAKE_OFF = px4_mode(Px4Main.AUTO, Px4Auto.TAKE_OFF)
LAND = px4_mode(Px4Main.AUTO, Px4Auto.LAND)
OFFBOARD = px4_mode(Px4Main.OFFBOARD)
POSITION = px4_mode(Px4Main.POSITION)
ALTITUDE = px4_mode(Px4Main.ALTITUDE)
# Measured: 1.42 s for COM_OF_LOSS_T 1.0; lost vision 4.8 to 5.6 s for EKF2_NOAID_TOUT 5 s, 1 s for 0.9 s.
_GRANULARITY_S, _NOTICED_S = 0.42, 0.1
_SPOOL_S = 1.0
_CLIMB_M_S, _REACHED_M = 1.0, 0.1
_LOSS_MODES = {0: POSITION, 1: ALTITUDE, 2: px4_mode(Px4Main.STABILIZED), 4: LAND, 5: HOLD}
_LEVEL = (ALTITUDE, px4_mode(Px4Main.STABILIZED), px4_mode(Px4Main.MANUAL))
# Follow a target, precision landing, and modes of companion computers.
_AUTO_MODES = frozenset(Px4Auto) | {8, 9} | frozenset(range(11, 19))
# MAV_MODE_FLAG.
_CUSTOM, _AUTO, _GUIDED, _STABILIZE, _MANUAL = 1, 4, 8, 16, 64


class Px4(AutopilotFirmware):
    """OFFBOARD needs a stream of setpoints to arm and to stay in."""

    flavour = Flavour.PX4
    guided = OFFBOARD
    landing = LAND
    disarmed_text = "Disarmed by landing"

    def __init__(self, copter: MavlinkCopter, parameters: Parameters) -> None:
        super().__init__(copter, parameters, HOLD)
        self._climb_to_m: float | None = None

    def knows(self, mode: int) -> bool:
        """Return whether a mode exists."""
        return mode in (HOLD, LAND, OFFBOARD, POSITION, TAKE_OFF, *_LEVEL)

    def arming_fault(self) -> str:
        """Return its reason not to arm now, or ""."""
        fault = self.health_fault()
        if fault:
            return f"Arming denied: {fault}"
        if self.mode != OFFBOARD and self.global_position:
            return ""
        if self.mode != OFFBOARD:
            # WIRE (docs/reference/mavlink.md 2): Hold needs a global position, and indoors there is none.
            return "Arming denied: Resolve system health failures first"
        return "" if self.streams else "Arming denied: no offboard signal"

    def take_off(self, height_m: float) -> Answer:
        """Climb in AUTO.TAKEOFF, then hold; without a global position there is no such mode.

        height_m: above sea level, as the command says; 0: MIS_TAKEOFF_ALT above the floor.
        """
        if not self.global_position or self.satellites is None:
            self.say(2, "Takeoff denied: no global position")
            return MavResult.TEMPORARILY_REJECTED, "no global position"
        height = self.satellites.height_of(height_m) if height_m else self.parameters["MIS_TAKEOFF_ALT"]
        self.enter(TAKE_OFF)
        self._climb_to_m = height
        return MavResult.ACCEPTED, ""

    def order_mode(self, params: tuple[float, ...]) -> Answer:
        """Change the mode by base mode, main mode and sub-mode.

        WIRE (PX4 1.15, source): a main mode that does not exist is accepted, and changes nothing; so is a base mode
        that names none. Without a custom mode the flags of the base mode count.
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

        WIRE (docs/reference/mavlink.md 5.2): once armed, OFFBOARD is refused unless setpoints keep coming.
        """
        if mode == OFFBOARD and self.armed and self.setpoint_age_s > self.parameters["COM_OF_LOSS_T"]:
            self.say(2, "Switching to Offboard is currently not available")
            return MavResult.TEMPORARILY_REJECTED, "no offboard signal"
        return super().set_mode(mode)

    def reposition(self, parameters: tuple[float, ...]) -> Answer:
        """Hold here if no place is named; WIRE (docs/reference/mavlink.md 5.11): QGroundControl's Pause."""
        if parameters[1] != 1.0 or not all(map(math.isnan, parameters[3:])):
            return super().reposition(parameters)
        return self.set_mode(HOLD)

    def enter(self, mode: int) -> None:
        """Change the mode, which ends a take-off; AUTO.TAKEOFF without a height climbs to that of the parameter."""
        self._climb_to_m = self.parameters["MIS_TAKEOFF_ALT"] if mode == TAKE_OFF else None
        super().enter(mode)

    def step(self, now_s: float, ground_silence_s: float) -> None:
        """Climb when asked to, then watch over time-outs."""
        super().step(now_s, ground_silence_s)
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
