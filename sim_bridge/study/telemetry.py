"""Messages of one drone's driver, made from the readings of its onboard sensors."""

import math

from groundstation.bus.messages import FlightState, Header, ImuSample, Odometry, VehicleStatus
from sim_bridge.world.ardrone import Quadrotor
from sim_bridge.world.ardrone_autopilot import Phase
from sim_bridge.world.ardrone_sensors import Onboard

_STATES = {
    Phase.LANDED: FlightState.LANDED,
    Phase.TAKING_OFF: FlightState.TAKING_OFF,
    Phase.HOVERING: FlightState.HOVERING,
    Phase.FLYING: FlightState.FLYING,
    Phase.BRAKING: FlightState.FLYING,
    Phase.LOOPING: FlightState.FLYING,
    Phase.LANDING: FlightState.LANDING,
    Phase.CUT: FlightState.EMERGENCY,
}
_JUMP_RAD = math.radians(20.0)
_PERIOD_TICKS = 4  # 50 Hz, as its driver publishes
_COVARIANCE = (0.0025, 0.0, 0.0, 0.0, 0.0025, 0.0, 0.0, 0.0, 0.01)


class TelemetryPublisher:
    """Builds odometry and status messages of one drone; counts heading jumps as resets, as a driver does.

    phase: its tick among those of a period, so that the drones of a team do not all publish at the same time.
    """

    def __init__(self, name: str, drone: Quadrotor, onboard: Onboard, clock: str, phase: int = 0) -> None:
        self._name, self._drone, self._onboard, self._clock = name, drone, onboard, clock
        self._yaw, self._reset, self._seq, self._ticks = onboard.yaw, 0, 0, phase

    def odometry(self, stamp_ns: int) -> Odometry | None:
        """Return the reading of this tick, if one is due; call it once per tick."""
        onboard = self._onboard
        if abs(math.remainder(onboard.yaw - self._yaw, math.tau)) > _JUMP_RAD:
            self._reset += 1
        self._yaw = onboard.yaw
        self._ticks += 1
        if self._ticks % _PERIOD_TICKS:
            return None
        return Odometry(
            header=self._header(stamp_ns),
            velocity_m_s=(onboard.vx, onboard.vy, 0.0),
            velocity_covariance=_COVARIANCE,
            yaw_rad=onboard.yaw,
            roll_rad=onboard.roll,
            pitch_rad=onboard.pitch,
            height_m=onboard.height if onboard.height > 0.0 else None,
            reset=self._reset,
        )

    def inertia(self, stamp_ns: int) -> ImuSample:
        """Return the readings of gyroscopes and accelerometers at this tick."""
        return ImuSample(
            header=self._header(stamp_ns),
            angular_velocity_rad_s=self._onboard.gyros,
            specific_force_m_s2=self._onboard.accelerometers,
        )

    def status(self, stamp_ns: int, mode: str) -> VehicleStatus:
        """Return the vehicle's state, in a driver's mode."""
        state = _STATES[self._drone.autopilot.phase]
        return VehicleStatus(header=self._header(stamp_ns), flight_state=state, mode=mode)

    def _header(self, stamp_ns: int) -> Header:
        self._seq += 1
        return Header(stamp_ns, self._clock, self._name, self._name, self._seq)
