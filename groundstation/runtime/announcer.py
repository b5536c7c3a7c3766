"""Publishes the tracker's results: estimate, belief, setpoints, plan, innovations, journal, orders to land."""

from collections.abc import Iterable, Mapping

import numpy as np

from groundstation.bus.api import Bus
from groundstation.bus.messages import (
    Belief,
    Control,
    Estimate,
    Innovation,
    JournalEntry,
    MovedCamera,
    Plan,
    SearchMap,
    SensorLateness,
    VelocitySetpoint,
)
from groundstation.bus.topics import BELIEF, ESTIMATE, INNOVATION, JOURNAL, PLAN, SEARCH_MAP, SETPOINT
from groundstation.control.output_limiter import Limited
from groundstation.estimation.measurement import Correction
from groundstation.planning.planner import PlanResult
from groundstation.runtime.asking import TEAM
from groundstation.tracker import Tracker

_SHADES = 255.0  # value of the likeliest cell of a map


class Announcer:
    """Turns the tracker's values into messages. Estimates, beliefs and setpoints are stamped with the belief's time."""

    def __init__(self, bus: Bus, lifetime_ms: int) -> None:
        self._bus = bus
        self._lifetime_ms = lifetime_ms

    def estimate(self, tracker: Tracker, now_ns: int) -> None:
        """Publish the estimate of each entity."""
        header = self._bus.header(TEAM, now_ns)
        searches = tracker.lookout.searches(now_ns)
        message = Estimate(header=header, entities=tracker.estimates(), epoch=tracker.epoch, searches=searches)
        self._bus.publish(ESTIMATE, message)

    def belief(self, tracker: Tracker, lateness: tuple[SensorLateness, ...], now_ns: int) -> None:
        """Publish the joint belief, how late each camera seems to be, and which were bumped."""
        belief = tracker.belief
        moved = tuple(MovedCamera(name, since_ns) for name, since_ns in sorted(tracker.mounts.turned_ns.items()))
        upper = belief.covariance[np.triu_indices(belief.layout.dim)]
        message = Belief(
            header=self._bus.header(TEAM, now_ns),
            mean=tuple(belief.mean.tolist()),
            covariance_upper=tuple(upper.tolist()),
            layout=belief.layout.labels,
            lateness=lateness,
            moved=moved,
        )
        self._bus.publish(BELIEF, message)

    def search_maps(self, tracker: Tracker, now_ns: int) -> None:
        """Publish the map of each target that is searched for."""
        for name, room in tracker.lookout.maps().items():
            grid, chances = room.grid, room.chances
            message = SearchMap(
                header=self._bus.header(name, now_ns),
                first_m=(round(float(grid.xs[0]), 3), round(float(grid.ys[0]), 3)),
                cell_m=round(grid.cell_m, 4),
                columns=len(grid.xs),
                chances=tuple(np.rint(_SHADES * chances / chances.max()).astype(int).ravel().tolist()),
            )
            self._bus.publish(SEARCH_MAP, message)

    def setpoints(self, tracker: Tracker, limited: Mapping[str, Limited], now_ns: int) -> None:
        """Publish one setpoint per airborne robot; one that is not localised hovers, as not converged."""
        for name, entry in limited.items():
            message = VelocitySetpoint(
                header=self._bus.header(name, now_ns),
                velocity_m_s=entry.setpoint.velocity_m_s,
                yaw_rate_rad_s=entry.setpoint.yaw_rate_rad_s,
                lifetime_ms=self._lifetime_ms,
                epoch=tracker.epoch,
                converged=tracker.converged(name) and name not in tracker.holding,
                holds=entry.holds,
            )
            self._bus.publish(SETPOINT, message)

    def plan(self, plan: PlanResult, limited: Mapping[str, Limited], mode: str) -> None:
        """Publish a plan that was adopted, with the setpoints that the output limiter makes of it now."""
        controls = tuple(
            Control(
                name, entry.setpoint.velocity_m_s, entry.setpoint.yaw_rate_rad_s, entry.limited_by, entry.wanted_m_s
            )
            for name, entry in limited.items()
        )
        message = Plan(
            header=self._bus.header(TEAM, plan.stamp_ns),
            topology=str(plan.topology),
            cost=plan.cost,
            controls=controls,
            edges=plan.edges,
            alternatives=plan.alternatives,
            solver=plan.solver,
            mode=mode,
        )
        self._bus.publish(PLAN, message)

    def innovations(self, corrections: Iterable[Correction], now_ns: int) -> None:
        """Publish the verdict on each observation."""
        for correction in corrections:
            message = Innovation(
                header=self._bus.header(correction.observer, now_ns),
                observer=correction.observer,
                subject=correction.subject,
                verdict=correction.verdict,
                residual=correction.residual,
                covariance=correction.covariance,
                nis=correction.nis,
                latency_ms=correction.latency_ms,
                reason=correction.reason,
            )
            self._bus.publish(INNOVATION, message)

    def journal(self, entry: JournalEntry) -> None:
        """Publish a journal entry."""
        self._bus.publish(JOURNAL, entry)
