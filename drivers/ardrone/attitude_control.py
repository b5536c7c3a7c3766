"""Chooses an AR.Drone's command: to hold its place by itself, the velocity loop's attitude, or a braking attitude.

Pure. A drone holds its place by the optical flow by which it measures its velocity. Where that fails while it hovers or
lands, the driver brakes it.
"""

from typing import NamedTuple

from drivers.ardrone.adrift import AdriftWatch
from drivers.ardrone.blind_descent import BlindDescent
from drivers.ardrone.settings import ArDroneLimits
from drivers.ardrone.velocity_doubt import VelocityDoubt
from drivers.ardrone.velocity_loop import HOVER, AttitudeRequest, VelocityLoop
from drivers.watchdog_types import Action, WatchdogDecision
from groundstation.bus.messages import Vector3
from groundstation.time_units import NS_PER_S

# A blind drone that falls silent or freezes is braked further by the loop's observer, until it would land for that.
_BRAKED_ON_NS = 3 * NS_PER_S


class MotionReport(NamedTuple):
    """A drone's report of its motion.

    fresh: telemetry arrived a moment ago; told: fresh, with new contents; repeats: its velocity is no measurement;
    able: fresh, it flies, and its reports besides the velocity are sound; blind: able, and its optical flow fails;
    flowless: blind, and not because of a velocity stuck in motion; velocity_m_s: true (scaled), FLU; force_m_s2:
    specific force forward and left, None if not reported; height_m: above the floor, likewise; obeys: False while it is
    known that no command arrives.
    """

    fresh: bool
    told: bool
    repeats: bool
    able: bool
    blind: bool
    flowless: bool
    velocity_m_s: Vector3
    force_m_s2: tuple[float, float] | None
    height_m: float | None
    obeys: bool = True


class AttitudeControl:
    """Turns the watchdog's decisions into attitudes, at the sender's rate; sinks: whether a landing is braked now."""

    def __init__(self, limits: ArDroneLimits) -> None:
        self._limits = limits
        self._loop = VelocityLoop(limits)
        self._descent, self._adrift = BlindDescent(), AdriftWatch()
        self.sinks = False
        self._turn_ns = 0
        self._blind_ns = -_BRAKED_ON_NS
        self._doubt = VelocityDoubt()

    @property
    def doubted(self) -> str:
        """Return why the drone's velocity is doubted, or ""."""
        return self._doubt.reason

    @property
    def blind(self) -> bool:
        """Return whether commands or cameras have shown that the drone sees no floor."""
        return self._doubt.blind

    def trust(self) -> None:
        """Trust the reported velocity again: the drone stands."""
        self._doubt.reset()

    def step(self, now_ns: int, decision: WatchdogDecision, report: MotionReport) -> AttitudeRequest:
        """Return the attitude for a decision."""
        dt_s = (now_ns - self._turn_ns) * 1e-9
        self._turn_ns = now_ns
        if decision.action is Action.IDLE and report.fresh and report.force_m_s2 is not None:
            self._loop.stand(report.force_m_s2, dt_s)
        report = self._judged(now_ns, dt_s, decision, report)
        self.sinks = self._descent.step(now_ns, decision.action is Action.LAND, report.flowless, report.height_m)
        unguided = self._is_unguided(now_ns, decision, report, dt_s)
        if unguided and (self.sinks or decision.action is Action.HOVER):
            climb_m_s = -self._limits.max_climb_m_s if self.sinks else 0.0
            force = report.force_m_s2 if report.told else None
            return self._loop.brake(dt_s, force, decision.seen_m_s, climb_m_s)
        return self._guided(now_ns, decision, report, dt_s)

    def _judged(self, now_ns: int, dt_s: float, decision: WatchdogDecision, report: MotionReport) -> MotionReport:
        """Return the report with what commands and cameras have shown of the drone's optical flow."""
        told, seen = report.velocity_m_s if report.told and not report.repeats else None, decision.seen_m_s
        commanded_m_s = self._loop.commanded_m_s
        flown = decision.action is Action.FLY or decision.back_m_s is not None
        if self._doubt.step(now_ns, decision.action, told, seen, commanded_m_s, flown) and seen is not None:
            self._loop.recover(seen, dt_s)  # its own velocity gives no speed from which to brake it
        if not (self._doubt.blind and report.able):
            return report
        return report._replace(blind=True, flowless=report.flowless or not report.repeats)

    def _is_unguided(self, now_ns: int, decision: WatchdogDecision, report: MotionReport, dt_s: float) -> bool:
        """Return whether the drone's own hover would not stop it: it is or was blind, or cameras see it drift."""
        if report.blind and report.told:
            self._blind_ns = now_ns
        was_blind = not report.told and now_ns - self._blind_ns <= _BRAKED_ON_NS
        known, seen = self._adrift.adrift, decision.seen_m_s
        silent = not report.told or bool(self._doubt.reason)
        adrift = self._adrift.step(now_ns, decision.action is Action.HOVER, silent, seen)
        if adrift and not known and not was_blind and seen is not None:
            self._loop.hold((*seen, 0.0), dt_s)  # nothing else gives the speed from which to brake it
        return report.blind or was_blind or adrift

    def _guided(self, now_ns: int, decision: WatchdogDecision, report: MotionReport, dt_s: float) -> AttitudeRequest:
        """Return the attitude of a drone that follows its setpoint, or holds its place by itself."""
        # Commands that do not arrive cause no speed, and the first one that does is to stop what the last one did.
        deaf = decision.action is Action.FLY and not report.obeys
        holds = deaf or decision.action is Action.HOVER
        back = decision.back_m_s if holds else None
        if deaf:
            self._loop.lose()
        if holds and report.fresh and back is None:
            return self._loop.hold(report.velocity_m_s, dt_s)
        if not report.fresh:
            self._loop.lose()
            return HOVER
        if decision.action is not Action.FLY and back is None:
            self._loop.reset()
            return HOVER
        wanted = decision.velocity_m_s if back is None else back
        measured = None if report.repeats or report.blind else report.velocity_m_s
        force, seen = report.force_m_s2, decision.seen_m_s
        asked = self._loop.step(wanted, decision.yaw_rate_rad_s, measured, dt_s, force, seen)
        if not self._loop.contradicted:
            return asked
        if self._doubt.contradict(now_ns, report.velocity_m_s) and seen is not None:
            self._loop.recover(seen, dt_s)
        return HOVER
