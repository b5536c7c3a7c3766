"""Feeds ranges to the filter, and lets a robot join at the place that one round of ranges gives.

A single range places nothing, and ranges give no heading of a standing robot. The heading is that of the pad from when
a robot stood until it has flown, then its last estimate, each continued by the vehicle's own heading. It is unknown of
a robot that was never reported to stand, and after a reset of the vehicle's own heading, unless that is just a jump on
the ground or at lift-off: then another sensor must see the robot first, or ranges find it on its pad again.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from groundstation.arrays import Array
from groundstation.bus.messages import Odometry, RangeObservation, Vector3, Verdict
from groundstation.estimation.belief import JointBelief
from groundstation.estimation.fixed_lag import FixedLagFilter
from groundstation.estimation.measurement import SensorReading
from groundstation.estimation.ranged_robot import RangedRobot
from groundstation.field.room import ranging_link
from groundstation.geometry.rotations import rotation_z
from groundstation.time_units import NS_PER_MS, NS_PER_S

# A fix farther from the belief than this many deviations of both, and this distance [m], contradicts it: the belief is
# of now, the fix of slightly earlier.
_SIGMAS, _APART_M = 5.0, 0.2
# A robot is placed with a larger variance than its fix, by this factor: the following ranges have the same biases,
# which must not count twice.
_LESS_SURE = 25.0
# Contradictions farther apart than this are not in a row.
_IN_A_ROW_NS = 5 * NS_PER_S
# A robot on the ground does not turn unnoticed between two headings that are nearer than this: a jump is its compass.
_NO_TURN_NS = 300 * NS_PER_MS


@dataclass(slots=True)
class _Heading:
    """A vehicle's own heading; world heading minus own as last known (None: unknown), with variance and time.

    stands: whether it stood then; stood, flew: whether it ever did, `flew` since it was last put on its pad.
    """

    own_rad: float = 0.0
    reset: int = 0
    stamp_ns: int = 0
    offset_rad: float | None = None
    variance: float = 0.0
    known_ns: int = 0
    stands: bool = False
    stood: bool = False
    flew: bool = False

    def take(self, own_rad: float, reset: int, stamp_ns: int, aloft: bool) -> None:
        """Take the vehicle's own heading, which may have jumped; aloft: the vehicle may have turned meanwhile."""
        if reset != self.reset and self.offset_rad is not None:
            jumped = not aloft and stamp_ns - self.stamp_ns <= _NO_TURN_NS
            self.offset_rad = self.offset_rad + self.own_rad - own_rad if jumped else None
        self.own_rad, self.reset, self.stamp_ns = own_rad, reset, stamp_ns


class RangeIntake:
    """Feeds a filter with ranges; robots: those with a transponder, by system."""

    def __init__(self, joint: FixedLagFilter, robots: Mapping[str, Mapping[str, RangedRobot]]) -> None:
        self._filter, self._robots = joint, robots
        ranged = {name: one for own in robots.values() for name, one in own.items()}
        self._ranged, self._headings = ranged, {name: _Heading() for name in ranged}
        self._contradictions: dict[str, tuple[int, int, int]] = {}
        self._joined: list[tuple[str, str, bool]] = []

    def take_joined(self) -> list[tuple[str, str, bool]]:
        """Return and forget (system, robot, whether its estimate was elsewhere before) of placed robots."""
        joined, self._joined = self._joined, []
        return joined

    def take_heading(self, message: Odometry, stamp_ns: int, stands: bool) -> None:
        """Take a vehicle's own heading; stands: whether it reports that it is on the ground."""
        name = message.header.entity
        heading, robot = self._headings.get(name), self._ranged.get(name)
        if heading is None or robot is None or stamp_ns < heading.stamp_ns:
            return
        aloft = self._filter.airborne(name)
        heading.take(message.yaw_rad, message.reset, stamp_ns, aloft)
        heading.stands, heading.stood, heading.flew = stands, heading.stood or stands, heading.flew or aloft
        if heading.stood and not heading.flew:
            heading.offset_rad = robot.pad_yaw_rad - message.yaw_rad
            heading.variance, heading.known_ns = robot.pad_yaw_std_rad**2, stamp_ns

    def take(self, key: str, message: RangeObservation, stamp_ns: int, now_ns: int) -> Verdict:
        """Take one round of ranges with checked shape and numbers; ACCEPTED if any of it may count."""
        robot = self._robots.get(message.observer, {}).get(message.subject)
        if robot is None or message.header.entity != message.observer:
            return Verdict.UNKNOWN_ENTITY
        if self._joins(message, robot, stamp_ns, now_ns):
            return Verdict.ACCEPTED
        refusals, variance = [], message.std_m**2
        for anchor, range_m in message.ranges_m.items():
            sensor = ranging_link(message.observer, anchor, message.subject)
            reading = SensorReading(stamp_ns, sensor, message.subject, (range_m,), (variance,))
            tie = f"{key}#{message.subject}#{anchor}#{message.header.seq}"
            refusal = self._filter.add_observation(reading, tie, now_ns)
            if refusal is not None:
                refusals.append(refusal)
        return refusals[0] if len(refusals) == len(message.ranges_m) else Verdict.ACCEPTED

    def _joins(self, message: RangeObservation, robot: RangedRobot, stamp_ns: int, now_ns: int) -> bool:
        """Place a flying robot without a belief, or one that successive rounds of ranges contradict."""
        name, point = message.subject, message.position_m
        belief = self._filter.belief()
        known = name in belief.layout
        if known:
            self._remember(name, belief)
        if not self._filter.airborne(name):
            self._contradictions.pop(name, None)
            if point is not None:
                self._stands_at(point, robot, self._headings[name])
            return False
        if point is None:
            return False
        if known and not self._insists(message, belief, robot, stamp_ns):
            return False
        heading = self._headings[name]
        if heading.offset_rad is None:
            return False
        yaw = math.remainder(heading.offset_rad + heading.own_rad, math.tau)
        drifted = robot.yaw_drift**2 * max(0.0, (stamp_ns - heading.known_ns) / NS_PER_S)
        place = np.array(point) - rotation_z(yaw) @ np.array(robot.transponder_m)
        variances = [*(_LESS_SURE * np.diag(_square(message.covariance))).tolist(), heading.variance + drifted]
        self._filter.place(name, [*place.tolist(), yaw], variances, stamp_ns, now_ns)
        self._contradictions.pop(name, None)
        self._joined.append((message.observer, name, known))
        return True

    def _remember(self, name: str, belief: JointBelief) -> None:
        heading = self._headings[name]
        heading.offset_rad = float(belief.mean_of(name)[3]) - heading.own_rad
        heading.variance, heading.known_ns = float(belief.covariance_of(name)[3, 3]), belief.stamp_ns

    def _stands_at(self, point: Vector3, robot: RangedRobot, heading: _Heading) -> None:
        """Take the place of a robot on the ground: on its pad, an unknown heading is that of the pad again."""
        place = np.array(point) - rotation_z(robot.pad_yaw_rad) @ np.array(robot.transponder_m)
        if heading.stands and heading.offset_rad is None and math.dist(place[:2], robot.pad_m) < robot.pad_limit_m:
            heading.flew = False

    def _insists(self, message: RangeObservation, belief: JointBelief, robot: RangedRobot, stamp_ns: int) -> bool:
        """Count successive rounds that put a robot elsewhere; True when they are enough and last long enough."""
        name, mean = message.subject, belief.mean_of(message.subject)
        there = mean[:3] + rotation_z(float(mean[3])) @ np.array(robot.transponder_m)
        both = _square(message.covariance) + belief.covariance_of(name)[:3, :3]
        limit_m = _APART_M + _SIGMAS * math.sqrt(float(np.trace(both)))
        if math.dist(message.position_m or there, there) <= limit_m:
            self._contradictions.pop(name, None)
            return False
        count, since_ns, last_ns = self._contradictions.get(name, (0, stamp_ns, stamp_ns))
        if stamp_ns - last_ns > _IN_A_ROW_NS:
            count, since_ns = 0, stamp_ns
        self._contradictions[name] = count + 1, since_ns, stamp_ns
        settings = self._filter.parameters
        lasted = stamp_ns - since_ns >= settings.divergence_s * NS_PER_S
        return lasted and count + 1 >= settings.divergence_count


def _square(covariance: tuple[float, ...]) -> Array:
    return np.array(covariance).reshape(3, 3)
