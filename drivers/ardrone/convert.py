"""Units and frames: navdata to bus messages, our velocities to AT commands.

WIRE (docs/reference/ardrone.md 4.5): body x forward, y right, z down; theta nose up, phi right side down, psi
clockwise; mdeg, mm/s, mg, deg/s. Ours: x forward, y left, z up; roll right side down, pitch nose down, yaw
counter-clockwise.
"""

import math
from typing import NamedTuple

from drivers.ardrone.wire.errors import WireError
from drivers.ardrone.wire.navdata import Navdata
from drivers.ardrone.wire.options import ALTITUDE, PHYS_MEASURES, TIME, Demo, PhysMeasures
from drivers.ardrone.wire.state import FLYING_NO_VISION, ControlState, StateBit, join_control_state
from drivers.plausibility.motion import MotionSample
from groundstation.bus.messages import FlightState, Vector3
from groundstation.geometry.angles import difference, wrap
from groundstation.geometry.stabilized_frame import STANDARD_GRAVITY_M_S2

_RAD_FROM_MDEG = math.pi / 180_000
_RAD_FROM_DEG = math.pi / 180
_M_S2_FROM_MG = STANDARD_GRAVITY_M_S2 / 1000
# Values beyond these are no measurement of an AR.Drone.
_MOST_MDEG = 360_000.0
_MOST_MM_S = 30_000.0
_MOST_MM = 100_000
_MOST_DEG_S, _MOST_MG = 5_000.0, 50_000.0
# A heading step is a jump when it exceeds what the gyro explains by this much.
_JUMP_RAD = math.radians(8)
_JUMP_RATE_RAD_S = math.radians(100)
_GROUND_GAP_S = 0.5
_GAP_S = 5.0  # after a longer silence it may have a new battery
# Module constants: looking up an enum member costs as much as reading an option.
_FLY, _EMERGENCY, _TAKING_OFF = int(StateBit.FLY), int(StateBit.EMERGENCY), int(ControlState.TRANS_TAKEOFF)
_BLINDLY = join_control_state(ControlState.FLYING, FLYING_NO_VISION)
_PHASES: dict[int, FlightState] = {
    ControlState.TRANS_TAKEOFF: FlightState.TAKING_OFF,
    ControlState.TRANS_LANDING: FlightState.LANDING,
    ControlState.HOVERING: FlightState.HOVERING,
    ControlState.FLYING: FlightState.FLYING,
    ControlState.TRANS_GOTOFIX: FlightState.FLYING,
    ControlState.TRANS_LOOPING: FlightState.FLYING,
    ControlState.LANDED: FlightState.TAKING_OFF,
}


class NavdataMotion(NamedTuple):
    """The vehicle's motion by one packet, in our frames.

    velocity_m_s [base_stabilized], as reported, without scale; rates and specific force [base], None in demo mode;
    flies: by its state, also where it reports no height.
    """

    velocity_m_s: Vector3
    roll_rad: float
    pitch_rad: float
    yaw_rad: float
    height_m: float | None
    rates_rad_s: Vector3 | None
    specific_force_m_s2: Vector3 | None
    flies: bool = False


def motion_from_demo(packet: Navdata, demo: Demo) -> NavdataMotion:
    """Return the motion in a packet and its DEMO option; raises WireError (not_finite, implausible, option_size)."""
    _require_sane(demo)
    altitude = packet.read(ALTITUDE)
    # WIRE: DEMO vz is 0 in every recording of a real drone; ALTITUDE's is the rate of the altitude, positive up.
    climb_mm_s = -demo.vz_mm_s if altitude is None else altitude.vz_mm_s
    if not -_MOST_MM_S <= climb_mm_s <= _MOST_MM_S:
        raise WireError("not_finite" if climb_mm_s - climb_mm_s != 0.0 else "implausible", "climb rate")
    phys = packet.read(PHYS_MEASURES)
    rates, force = (None, None) if phys is None else _imu_from_phys(phys)
    return NavdataMotion(
        velocity_m_s=(demo.vx_mm_s / 1000, -demo.vy_mm_s / 1000, climb_mm_s / 1000),
        roll_rad=demo.phi_mdeg * _RAD_FROM_MDEG,
        pitch_rad=-demo.theta_mdeg * _RAD_FROM_MDEG,
        yaw_rad=wrap(-demo.psi_mdeg * _RAD_FROM_MDEG),
        height_m=_height(packet.state, demo),
        rates_rad_s=rates,
        specific_force_m_s2=force,
        flies=bool(packet.state & _FLY),
    )


def _require_sane(demo: Demo) -> None:
    _, _, theta, phi, psi, altitude_mm, vx, vy, vz, _ = demo
    # Comparisons with NaN are false, so one chained comparison rejects NaN together with values that are too large.
    turns = -_MOST_MDEG <= theta <= _MOST_MDEG and -_MOST_MDEG <= phi <= _MOST_MDEG and -_MOST_MDEG <= psi <= _MOST_MDEG
    moves = -_MOST_MM_S <= vx <= _MOST_MM_S and -_MOST_MM_S <= vy <= _MOST_MM_S and -_MOST_MM_S <= vz <= _MOST_MM_S
    if turns and moves and altitude_mm <= _MOST_MM:
        return
    angles, speeds = (theta, phi, psi), (vx, vy, vz)
    finite = all(map(math.isfinite, angles + speeds))
    raise WireError("implausible" if finite else "not_finite", f"DEMO {angles} {speeds} {altitude_mm}")


def charge_from_demo(demo: Demo) -> float | None:
    """Return the battery's charge, 0 to 1; None if it is not a number."""
    return demo.battery_percent / 100 if demo.battery_percent <= 100 else None


def _height(state: int, demo: Demo) -> float | None:
    # WIRE: DEMO's altitude is 0 on the ground and until shortly after lift-off.
    return demo.altitude_mm / 1000 if state & _FLY and demo.altitude_mm > 0 else None


def _imu_from_phys(phys: PhysMeasures) -> tuple[Vector3, Vector3]:
    wx, wy, wz = phys.rates_deg_s
    ax, ay, az = phys.accelerations_mg
    if not math.isfinite(wx + wy + wz + ax + ay + az):
        raise WireError("not_finite", "PHYS_MEASURES")
    if max(map(abs, (wx, wy, wz))) > _MOST_DEG_S or max(map(abs, (ax, ay, az))) > _MOST_MG:
        raise WireError("implausible", "PHYS_MEASURES")
    rates = (wx * _RAD_FROM_DEG, -wy * _RAD_FROM_DEG, -wz * _RAD_FROM_DEG)
    return rates, (ax * _M_S2_FROM_MG, -ay * _M_S2_FROM_MG, -az * _M_S2_FROM_MG)


def sample_from_motion(stamp_ns: int, packet: Navdata, motion: NavdataMotion) -> MotionSample:
    """Return the input of the plausibility check from a packet; raises WireError (option_size)."""
    time = packet.read(TIME)
    return MotionSample(
        stamp_ns,
        motion.velocity_m_s[:2],
        motion.roll_rad,
        motion.pitch_rad,
        (*(motion.rates_rad_s or ()), *(motion.specific_force_m_s2 or ())),
        None if time is None else round(time.seconds * 1e9),
    )


def flight_state_from_navdata(state: int, control_state: int | None) -> FlightState:
    """Return the drone's flight state: EMERGENCY and FLY bits decide, the control state names the phase.

    WIRE: the two are not consistent within a packet. FLY with the phase LANDED is about to leave the ground.
    """
    if state & _EMERGENCY:
        return FlightState.EMERGENCY
    phase = None if control_state is None else control_state >> 16
    if state & _FLY:
        return FlightState.FLYING if phase is None else _PHASES.get(phase, FlightState.FLYING)
    return FlightState.TAKING_OFF if phase == _TAKING_OFF else FlightState.LANDED


def says_no_vision(control_state: int) -> bool:
    """Return whether a drone that flies says that it sees nothing below.

    WIRE: minor state 6 of FLYING (SDK control_states.h, docs/reference/ardrone.md 4.2); of HOVERING it means another.
    """
    return control_state == _BLINDLY


class HeadingWatch:
    """Counts jumps of the heading, across which its increments are void.

    WIRE: at lift-off the magnetometer is fused in and psi jumps, 143 deg in one sample in a recorded flight. In flight
    the heading goes on through a silence, in which a drone keeps turning as last commanded (docs/decisions/0233).
    """

    def __init__(self) -> None:
        self.resets = 0
        self._yaw_rad: float | None = None
        self._stamp_ns = 0
        self._lifted = False

    def update(self, stamp_ns: int, motion: NavdataMotion) -> int:
        """Take the heading of a packet; returns the number of jumps so far."""
        elapsed_s = (stamp_ns - self._stamp_ns) * 1e-9
        lifted = motion.height_m is not None or (self._lifted and motion.flies)  # a height may be missing in flight
        gap_s = _GAP_S if lifted else _GROUND_GAP_S
        void = self._yaw_rad is not None and (elapsed_s > gap_s or self._has_jumped(elapsed_s, motion))
        self.resets += void or (lifted and not self._lifted)
        self._yaw_rad, self._stamp_ns, self._lifted = motion.yaw_rad, stamp_ns, lifted
        return self.resets

    def _has_jumped(self, elapsed_s: float, motion: NavdataMotion) -> bool:
        assert self._yaw_rad is not None
        explained = 0.0 if motion.rates_rad_s is None else motion.rates_rad_s[2] * elapsed_s
        step = difference(motion.yaw_rad, self._yaw_rad + explained)
        return abs(step) > _JUMP_RAD + _JUMP_RATE_RAD_S * elapsed_s
