"""Monitors one vehicle: takes samples of its motion, gives the health of its sensors. Pure.

On the floor values may stand still, and attitudes may be anything. There only telemetry that repeats altogether, or
whose clock stands, counts as wrong: otherwise a vehicle whose report "standing" is frozen could be sent up. During
take-off or landing it may touch the floor, and only its velocity may stand still.
"""

import math
from collections import deque
from typing import NamedTuple

from drivers.plausibility.clock_drift import ClockDrift
from drivers.plausibility.clock_watch import ClockWatch
from drivers.plausibility.health import ALL_GOOD, Finding, Health, HealthReport, Sensor
from drivers.plausibility.limits import PlausibilityLimits
from drivers.plausibility.repeats import RepeatWatch, StandstillWatch
from drivers.plausibility.tick_watch import TickWatch
from groundstation.bus.messages import AIRBORNE, UP, FlightState

_Judged = tuple[Sensor, Health, str]
_CLOCK_STANDS, _FROZEN = "its clock stands", "its telemetry is frozen: all values repeat"
# A vehicle's clock may be slower than it was measured to be by this share of the time. At most so slow a one is
# followed; in flight it is followed by so much more or less per second, as a queue that grows looks like a slow clock.
_SLOWER, _SLOWEST, _SETTLES_PER_S = 0.005, 0.02, 20e-6
# After a pause a step between two values means nothing.
_GAP_S = 0.3


class MotionSample(NamedTuple):
    """Motion in one packet. stamp_ns: receipt; vehicle_ns: time on the vehicle's clock, None if it has none; counted_s:
    likewise of a counter that runs with its motors.

    velocity_m_s: horizontal, as reported, in axes of the vehicle's choice; heading_rad: of the vehicle in these axes;
    climb_m_s: 0 if none is used. roll_rad, pitch_rad [FLU]; inertial: rates and specific forces, empty if not reported.
    """

    stamp_ns: int
    velocity_m_s: tuple[float, float]
    roll_rad: float
    pitch_rad: float
    inertial: tuple[float, ...] = ()
    vehicle_ns: int | None = None
    heading_rad: float = 0.0
    climb_m_s: float = 0.0
    counted_s: int | None = None

    @property
    def speed_m_s(self) -> float:
        """Return the speed, climb included."""
        return math.hypot(*self.velocity_m_s, self.climb_m_s)

    @property
    def lean_rad(self) -> tuple[float, float]:
        """Return the (small) tilts towards the axes of the velocity."""
        forward, left = self.pitch_rad, -self.roll_rad
        c, s = math.cos(self.heading_rad), math.sin(self.heading_rad)
        return c * forward - s * left, s * forward + c * left


class MotionMonitor:
    """Health of the sensors of one vehicle; `report` is replaced as a whole, so that another thread may read it.

    clock: figures of its clock against ours, also on the floor.
    """

    def __init__(self, limits: PlausibilityLimits) -> None:
        self.limits = limits
        self._contents, self._attitude, self._inertial = RepeatWatch(), RepeatWatch(), RepeatWatch()
        self._velocity = (StandstillWatch(), StandstillWatch())
        self._ticks = TickWatch()
        self._slow: float | None = None
        self._noted_ns = 0
        self._clock, self.clock = ClockWatch(limits.clock_wrap_s, _SLOWER), ClockDrift()
        self.reset()

    def reset(self) -> None:
        """Forget everything, for a vehicle that stands."""
        self.report = ALL_GOOD
        for watch in (self._contents, self._attitude, self._inertial, *self._velocity, self._clock, self._ticks):
            watch.reset()
        self._before: MotionSample | None = None
        self._sound: MotionSample | None = None
        self._beyond_ns: dict[Sensor, int] = {}
        self._jumped_ns: dict[Sensor, deque[int]] = {}
        self._held: dict[Sensor, tuple[int, Finding]] = {}

    def update(self, sample: MotionSample, state: FlightState) -> HealthReport:
        """Take a sample of a vehicle in a flight state; return the present health report."""
        if sample.vehicle_ns is not None:
            self._follow_clock(sample.stamp_ns, sample.vehicle_ns, state in AIRBORNE)
        if state not in AIRBORNE:
            if self._before is not None:
                self.reset()
            self.report = self._settle(sample.stamp_ns, self._judge_standing(sample))
            return self.report
        judged = self._judge_repeats(sample, state in UP)
        judged += self._judge_clock(sample) + self._judge_ticks(sample)
        judged += self._judge_values(sample)
        withheld = not self._is_sound(sample)
        self._before = sample
        self.report = self._settle(sample.stamp_ns, judged, withheld)
        return self.report

    def _follow_clock(self, stamp_ns: int, vehicle_ns: int, flies: bool) -> None:
        """Measure the rate of the vehicle's clock, and follow it where it is slow: that is no lateness."""
        self.clock.update(stamp_ns, vehicle_ns)
        elapsed_s, self._noted_ns = (stamp_ns - self._noted_ns) * 1e-9, stamp_ns
        figures = self.clock.figures
        if figures is None or figures.drift_ppm is None:
            return
        slow = min(max(-1e-6 * figures.drift_ppm, 0.0), _SLOWEST)
        if flies and self._slow is not None:
            most = _SETTLES_PER_S * elapsed_s
            slow = min(max(slow, self._slow - most), self._slow + most)
        self._slow = slow
        self._clock.slower = _SLOWER + slow

    def _is_sound(self, sample: MotionSample) -> bool:
        """Return whether a velocity is possible, and near the last one that was, or else near the one before it.

        So the first value after a jump waits for the next one to confirm it.
        """
        limits, before, sound = self.limits, self._before, self._sound
        if sample.speed_m_s > limits.speed_m_s:
            return False
        confirmed = before is not None and before.speed_m_s <= limits.speed_m_s and not self._jumps(before, sample)
        if not confirmed and sound is not None and self._jumps(sound, sample):
            return False
        self._sound = sample
        return True

    def _jumps(self, before: MotionSample, after: MotionSample) -> bool:
        """Return whether a velocity changes faster than the vehicle can change it; not after a pause."""
        elapsed_s = (after.stamp_ns - before.stamp_ns) * 1e-9
        step = math.dist(after.velocity_m_s, before.velocity_m_s)
        return elapsed_s <= _GAP_S and step > self.limits.jump_m_s + self.limits.acceleration_m_s2 * elapsed_s

    def _settle(self, now_ns: int, judged: list[_Judged], withheld: bool = False) -> HealthReport:
        """Hold each verdict for a while, the worse one first."""
        if not (judged or self._held or withheld):
            return ALL_GOOD
        hold_ns = round(self.limits.hold_s * 1e9)
        for sensor, health, reason in judged:
            held = self._held.get(sensor)
            if held is None or health >= held[1].health or now_ns - held[0] > hold_ns:
                self._held[sensor] = (now_ns, Finding(sensor, health, reason))
        self._held = {sensor: held for sensor, held in self._held.items() if now_ns - held[0] <= hold_ns}
        findings = sorted((one for _, one in self._held.values()), key=lambda one: -one.health)
        return HealthReport(tuple(findings), withheld)

    def _judge_standing(self, sample: MotionSample) -> list[_Judged]:
        limits, stamp_ns, judged = self.limits, sample.stamp_ns, list[_Judged]()
        if sample.vehicle_ns is not None:
            stands_s, _ = self._clock.update(stamp_ns, sample.vehicle_ns)
            judged += [(Sensor.CLOCK, Health.BAD, _CLOCK_STANDS)] if stands_s >= limits.clock_stands_s else []
        if sample.inertial and limits.stirs_on_floor:
            frozen_s = self._contents.update(stamp_ns, _contents_of(sample))
            judged += _repeated(Sensor.TELEMETRY, frozen_s, limits.frozen_s, _FROZEN)
        return judged

    # -- repetitions -------------------------------------------------------------------------------------------------

    def _judge_repeats(self, sample: MotionSample, flies: bool) -> list[_Judged]:
        limits, stamp_ns = self.limits, sample.stamp_ns
        tilt = (sample.roll_rad, sample.pitch_rad)
        frozen_s = self._contents.update(stamp_ns, _contents_of(sample))
        attitude_s = self._attitude.update(stamp_ns, tilt)
        inertial_s = self._inertial.update(stamp_ns, sample.inertial) if sample.inertial else 0.0
        judged = self._judge_standstill(sample, flies)
        if frozen_s or attitude_s or inertial_s:
            judged += _repeated(Sensor.TELEMETRY, frozen_s, limits.frozen_s, _FROZEN)
            judged += _repeated(Sensor.ATTITUDE, attitude_s, limits.stuck_s, "its attitude is stuck")
            judged += _repeated(Sensor.IMU, inertial_s, limits.stuck_s, "its IMU is stuck")
        return judged

    def _judge_standstill(self, sample: MotionSample, flies: bool) -> list[_Judged]:
        limits, judged = self.limits, list[_Judged]()
        if not flies:
            for watch in self._velocity:
                watch.reset()
            return judged
        axes = zip(self._velocity, sample.velocity_m_s, sample.lean_rad, strict=True)
        held = [(*watch.update(sample.stamp_ns, velocity, tilt), velocity) for watch, velocity, tilt in axes]
        stuck_m_s = math.hypot(*(velocity for held_s, _, velocity in held if held_s))
        for held_s, change_m_s, _ in held:
            if held_s:
                needed_s = limits.stuck_s if change_m_s >= limits.stuck_m_s else limits.stuck_alone_s
                reason = f"reported velocity stuck at {stuck_m_s:.2f} m/s"
                judged += _repeated(Sensor.VELOCITY, held_s, needed_s, reason)
        return judged

    # -- its clock ----------------------------------------------------------------------------------------------------

    def _judge_clock(self, sample: MotionSample) -> list[_Judged]:
        if sample.vehicle_ns is None:
            return []
        stands_s, late_s = self._clock.update(sample.stamp_ns, sample.vehicle_ns)
        if stands_s >= self.limits.clock_stands_s:
            return [(Sensor.CLOCK, Health.BAD, _CLOCK_STANDS)]
        return self._judge_lateness(late_s, late_s)

    def _judge_ticks(self, sample: MotionSample) -> list[_Judged]:
        if sample.counted_s is None:
            return []
        newest_s, both_s = self._ticks.update(sample.stamp_ns, sample.counted_s)
        # A verdict lasts until the next step: after a pause of the link a punctual one ends it at once.
        self._held.pop(Sensor.CLOCK, None)
        return self._judge_lateness(newest_s, both_s)

    def _judge_lateness(self, late_s: float, certain_s: float) -> list[_Judged]:
        if late_s < self.limits.clock_suspect_s:
            return []
        health = Health.BAD if certain_s >= self.limits.clock_late_s else Health.SUSPECT
        return [(Sensor.CLOCK, health, f"its telemetry is {late_s:.1f} s late")]

    # -- values and steps ---------------------------------------------------------------------------------------------

    def _judge_values(self, sample: MotionSample) -> list[_Judged]:
        limits, before, judged = self.limits, self._before, list[_Judged]()
        speed = sample.speed_m_s
        tilt = max(abs(sample.roll_rad), abs(sample.pitch_rad))
        if speed > limits.speed_m_s or tilt > limits.tilt_rad or self._beyond_ns:
            degrees = f"a tilt of {math.degrees(tilt):.0f} deg"
            judged += self._beyond(Sensor.VELOCITY, sample, speed > limits.speed_m_s, f"{speed:.1f} m/s")
            judged += self._beyond(Sensor.ATTITUDE, sample, tilt > limits.tilt_rad, degrees)
        elapsed_s = math.inf if before is None else (sample.stamp_ns - before.stamp_ns) * 1e-9
        if before is None or elapsed_s > _GAP_S:
            return judged
        turned = max(abs(sample.roll_rad - before.roll_rad), abs(sample.pitch_rad - before.pitch_rad))
        if self._jumps(before, sample):
            step = math.dist(sample.velocity_m_s, before.velocity_m_s)
            judged.append(self._jumped(Sensor.VELOCITY, sample, f"its velocity jumps by {step:.1f} m/s"))
        if turned > limits.jump_rad + limits.turn_rad_s * elapsed_s:
            judged.append(
                self._jumped(Sensor.ATTITUDE, sample, f"its attitude jumps by {math.degrees(turned):.0f} deg")
            )
        return judged

    def _beyond(self, sensor: Sensor, sample: MotionSample, beyond: bool, value: str) -> list[_Judged]:
        if not beyond:
            self._beyond_ns.pop(sensor, None)
            return []
        since_ns = self._beyond_ns.setdefault(sensor, sample.stamp_ns)
        bad = sample.stamp_ns - since_ns >= self.limits.beyond_s * 1e9
        return [(sensor, Health.BAD if bad else Health.SUSPECT, f"it claims {value}, which it cannot do")]

    def _jumped(self, sensor: Sensor, sample: MotionSample, reason: str) -> _Judged:
        limits = self.limits
        times = self._jumped_ns.setdefault(sensor, deque(maxlen=limits.jumps))
        times.append(sample.stamp_ns)
        often = len(times) == limits.jumps and times[-1] - times[0] <= limits.jumps_within_s * 1e9
        return sensor, Health.BAD if often else Health.SUSPECT, reason


def _contents_of(sample: MotionSample) -> tuple[object, ...]:
    return sample.velocity_m_s, (sample.roll_rad, sample.pitch_rad), sample.inertial


def _repeated(sensor: Sensor, held_s: float, limit_s: float, reason: str) -> list[_Judged]:
    # Half of the limit gives reason for doubt.
    if held_s < limit_s / 2:
        return []
    return [(sensor, Health.BAD if held_s >= limit_s else Health.SUSPECT, reason)]
