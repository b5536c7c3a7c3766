"""A MAVLink vehicle with driver and autopilot at message level: odometry, setpoints, poses fed back.

The loop is closed as in flight: the tracker's belief aids the vehicle's estimate, whose velocity comes back as
odometry. Of the driver's code the choice of positions to send, the drift feedback and the deviations of the attitude
are used.
"""

import math

from drivers.mavlink.drift import DriftFeedback
from drivers.mavlink.settings import VisionFeedback
from drivers.mavlink.uncertainty import StatedUncertainty
from drivers.mavlink.vision import VisionFeed
from groundstation.bus.messages import EntityEstimate, Estimate, FlightState, Header, Odometry, VehicleStatus
from groundstation.vectors import Vector3
from sim_bridge.world.mavlink_copter import MavlinkCopter, Steering
from sim_bridge.world.world import TICK_S

_PERIOD_TICKS = 4  # 50 Hz
_VISION_TICKS = 7  # 28.6 Hz
_VISION = VisionFeedback()
_STAND_S, _TAKE_OFF_M, _CLIMB_M_S = 2.0, 0.8, 0.4
_COVARIANCE = (0.0025, 0.0, 0.0, 0.0, 0.0025, 0.0, 0.0, 0.0, 0.05)
_ATTITUDE_STD_RAD = math.radians(0.3)


class CopterLink:
    """A short model of one vehicle's driver; call `step` once per tick. landed: it landed because no camera saw it."""

    def __init__(self, name: str, copter: MavlinkCopter, clock: str, lifetime_s: float) -> None:
        self._name, self._copter, self._clock, self._lifetime_s = name, copter, clock, lifetime_s
        self._until_s = -math.inf
        self._ticks = self._seq = 0
        self._heading = 0.0
        self._climbing = True
        self.landed = False
        self._doubt_rad = _ATTITUDE_STD_RAD
        self._drift, self._stated = DriftFeedback(), StatedUncertainty()
        body = copter.airframe
        self._vision = VisionFeed(name, clock, _VISION, (body.x, body.y), body.yaw)

    def obey(self, velocity: Vector3, yaw_rate: float, now_s: float) -> None:
        """Take a setpoint [base_stabilized]."""
        if not self._climbing and not self.landed:
            self._drift.let_go()
            self._fly(velocity, yaw_rate, now_s)
            self._until_s = now_s + self._lifetime_s

    def step(self, now_s: float, estimates: tuple[EntityEstimate, ...]) -> None:
        """Start, hover without setpoints, feed poses."""
        self._ticks += 1
        copter = self._copter
        self._heading = math.remainder(self._heading + copter.estimate.yaw_rate * TICK_S, math.tau)
        if copter.airborne:
            self._drift.lift()
        else:
            self._drift.stand(round(now_s * 1e9))
        if self._ticks % _VISION_TICKS == 0:
            self._feed(estimates, round(now_s * 1e9))
        if self._climbing and now_s > _STAND_S:
            if copter.steering is Steering.OFF:
                copter.steer(Steering.IDLE)
            forward, left, _ = self._drift.hold(round(now_s * 1e9))
            self._fly((forward, left, _CLIMB_M_S), 0.0, now_s)
            if copter.estimate.position[2] > _TAKE_OFF_M:
                self._climbing = False
                self._drift.let_go()  # it holds this height, not that of the floor
        elif copter.airborne and copter.estimate.aided_s > _VISION.land_after_s:
            copter.steer(Steering.LAND)
            self.landed = True
        elif not self._climbing and not self.landed and now_s > self._until_s:
            self._fly(self._drift.hold(round(now_s * 1e9)), 0.0, now_s)
        elif self.landed and not copter.airborne:
            copter.steer(Steering.OFF)

    def _fly(self, velocity: Vector3, yaw_rate: float, now_s: float) -> None:
        now_ns = round(now_s * 1e9)
        (x, y, z), correction = velocity, self._drift.correction(now_ns)
        self._drift.note_command(now_ns, velocity)
        self._copter.fly((x + correction[0], y + correction[1], z + correction[2]), yaw_rate)

    def _feed(self, estimates: tuple[EntityEstimate, ...], now_ns: int) -> None:
        """Send the position that the driver would send now."""
        header, airborne = Header(now_ns, self._clock, "team", "tracker", self._ticks), self._copter.airborne
        good = self._vision.take(now_ns, Estimate(header=header, entities=estimates, epoch=1))
        if good is not None and airborne:
            self._drift.take(now_ns, good, self._reported())
            self._stated.see_drift(now_ns, self._drift.size_m_s)
            self._doubt_rad = max(_ATTITUDE_STD_RAD, self._stated.attitude_std_rad(now_ns))
        if (seen := self._vision.sighted) is not None and airborne:
            self._drift.see_place(now_ns, seen.position_m, seen.yaw_rad)
        if (pose := self._vision.pose(now_ns, airborne)) is not None:
            self._copter.estimate.aid(pose.position_m, pose.yaw_rad, self._vision.resets)

    def odometry(self, stamp_ns: int) -> Odometry | None:
        """Return the reading of this tick, if one is due."""
        e = self._copter.estimate
        if self._ticks % _PERIOD_TICKS or not e.has_position:
            return None
        return Odometry(
            header=self._header(stamp_ns),
            velocity_m_s=self._reported(),
            velocity_covariance=_COVARIANCE,
            yaw_rad=self._heading,
            roll_rad=e.roll,
            pitch_rad=e.pitch,
            attitude_std_rad=self._doubt_rad,
        )

    def _reported(self) -> Vector3:
        e = self._copter.estimate
        c, s = math.cos(e.yaw), math.sin(e.yaw)
        vx, vy, vz = e.velocity
        return c * vx + s * vy, c * vy - s * vx, vz

    def status(self, stamp_ns: int, mode: str) -> VehicleStatus:
        """Return the vehicle's state, in a driver's mode."""
        state = FlightState.FLYING if self._copter.airborne else FlightState.LANDED
        return VehicleStatus(header=self._header(stamp_ns), flight_state=state, mode=mode)

    def _header(self, stamp_ns: int) -> Header:
        self._seq += 1
        return Header(stamp_ns, self._clock, self._name, self._name, self._seq)
