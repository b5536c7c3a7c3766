"""What driver and autopilot make of a MAVLink vehicle at message level: odometry, setpoints, and poses fed back.

The loop is closed as in flight: what the tracker believes aids the vehicle's estimate, whose velocity comes back as
odometry. Nothing of the driver's code is used here.
"""

import math

from groundstation.bus.messages import EntityEstimate, FlightState, Header, Odometry, VehicleStatus
from sim_bridge.world.mavlink_copter import MavlinkCopter, Steering
from sim_bridge.world.world import TICK_S

Vector3 = tuple[float, float, float]
_PERIOD_TICKS = 4  # 50 Hz
_VISION_TICKS = 7  # 28.6 Hz
_MAX_AGE_S, _MAX_STD_M = 10.0, 0.07
_LAND_AFTER_S = 2.0  # without a pose
_STAND_S, _TAKE_OFF_M, _CLIMB_M_S = 2.0, 0.8, 0.4
_COVARIANCE = (0.0225, 0.0, 0.0, 0.0, 0.0225, 0.0, 0.0, 0.0, 0.05)
_STILL: Vector3 = (0.0, 0.0, 0.0)


class CopterLink:
    """One vehicle's driver in short; call `step` once per tick. landed: it came down because no camera saw it."""

    def __init__(self, name: str, copter: MavlinkCopter, clock: str, lifetime_s: float) -> None:
        self._name, self._copter, self._clock, self._lifetime_s = name, copter, clock, lifetime_s
        self._until_s = -math.inf
        self._ticks = self._seq = self._resets = 0
        self._heading = 0.0
        self._climbing = True
        self.landed = False
        self._fed: Vector3 | None = None
        body = copter.airframe
        self._pad, self._pad_yaw = (body.x, body.y, body.z), body.yaw

    def obey(self, velocity: Vector3, yaw_rate: float, now_s: float) -> None:
        """Take a setpoint [base_stabilized]."""
        if not self._climbing and not self.landed:
            self._copter.fly(velocity, yaw_rate)
            self._until_s = now_s + self._lifetime_s

    def step(self, now_s: float, estimates: tuple[EntityEstimate, ...]) -> None:
        """Start, hover when told nothing, feed poses."""
        self._ticks += 1
        copter = self._copter
        self._heading = math.remainder(self._heading + copter.estimate.yaw_rate * TICK_S, math.tau)
        if self._ticks % _VISION_TICKS == 0:
            self._feed(estimates)
        if self._climbing and now_s > _STAND_S:
            if copter.steering is Steering.OFF:
                copter.steer(Steering.IDLE)
            copter.fly((0.0, 0.0, _CLIMB_M_S), 0.0)
            if copter.estimate.position[2] > _TAKE_OFF_M:
                self._climbing = False
        elif copter.airborne and copter.estimate.aided_s > _LAND_AFTER_S:
            copter.steer(Steering.LAND)
            self.landed = True
        elif not self._climbing and not self.landed and now_s > self._until_s:
            copter.fly(_STILL, 0.0)
        elif self.landed and not copter.airborne:
            copter.steer(Steering.OFF)

    def _feed(self, estimates: tuple[EntityEstimate, ...]) -> None:
        position, yaw = self._pad, self._pad_yaw
        if self._copter.airborne:
            mine = [e for e in estimates if e.name == self._name and _is_good(e)]
            if not mine:
                return
            position, yaw = (mine[0].mean[0], mine[0].mean[1], mine[0].mean[2]), mine[0].mean[3]
        if self._fed is not None and math.dist(position, self._fed) > 0.3:
            self._resets += 1
        self._fed = position
        self._copter.estimate.aid(position, yaw, self._resets)

    def odometry(self, stamp_ns: int) -> Odometry | None:
        """Return the reading of this tick, if one is due."""
        e = self._copter.estimate
        if self._ticks % _PERIOD_TICKS or not e.has_position:
            return None
        c, s = math.cos(e.yaw), math.sin(e.yaw)
        vx, vy, vz = e.velocity
        return Odometry(
            header=self._header(stamp_ns),
            velocity_m_s=(c * vx + s * vy, c * vy - s * vx, vz),
            velocity_covariance=_COVARIANCE,
            yaw_rad=self._heading,
            roll_rad=e.roll,
            pitch_rad=e.pitch,
        )

    def status(self, stamp_ns: int) -> VehicleStatus:
        """Return the vehicle's state."""
        state = FlightState.FLYING if self._copter.airborne else FlightState.LANDED
        return VehicleStatus(header=self._header(stamp_ns), flight_state=state, mode="TRACK")

    def _header(self, stamp_ns: int) -> Header:
        self._seq += 1
        return Header(stamp_ns, self._clock, self._name, self._name, self._seq)


def _is_good(estimate: EntityEstimate) -> bool:
    worst = max(estimate.covariance[i] for i in (0, 5, 10))
    return estimate.converged and estimate.age_s <= _MAX_AGE_S and worst <= _MAX_STD_M**2
