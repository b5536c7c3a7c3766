"""The tracker without I/O and clock: messages in; belief, plan and setpoints out."""

import math
from collections import Counter, defaultdict
from collections.abc import Callable, Mapping
from dataclasses import replace

import numpy as np

from groundstation.arrays import Array
from groundstation.bus.messages import EntityEstimate, Message, RelativeObservation, Severity, VehicleStatus, Verdict
from groundstation.bus.notice import Notice
from groundstation.control.drift import DriftWatch
from groundstation.control.flight_mode import FlightMode
from groundstation.control.hovering import Hovering
from groundstation.control.joinings import Joinings
from groundstation.control.lookout import Lookout
from groundstation.control.moment import Sight
from groundstation.control.output_limiter import Limited, limit_setpoint
from groundstation.control.plan_watch import PlanWatch
from groundstation.control.root_watch import RootWatch
from groundstation.control.setpoints import HOVER, setpoints_from_plan
from groundstation.control.shafts import Shafts
from groundstation.control.view import Localisation
from groundstation.errors import EstimatorFault
from groundstation.estimation.belief import JointBelief
from groundstation.estimation.entity_estimate import entity_estimate
from groundstation.estimation.fixed_lag import FixedLagFilter
from groundstation.estimation.ingest import REASONS, Intake
from groundstation.estimation.layout import EntityKind
from groundstation.estimation.measurement import Correction
from groundstation.estimation.models.ranging import RangeSensor
from groundstation.estimation.mount_watch import MOVED, MountWatch
from groundstation.field.resolved import ResolvedField
from groundstation.geometry.stabilized_frame import world_from_stabilized
from groundstation.planning.planner import Planner, PlanRequest, PlanResult
from groundstation.sensing.topology import Topology
from groundstation.tracker_parameters import TrackerParameters, parameters_from_field


def tracker_from_field(field: ResolvedField, clock: str, epoch: int) -> "Tracker":
    """Return the tracker for a resolved field."""
    return Tracker(parameters_from_field(field), clock, epoch)


class Tracker:
    """Holds the joint filter, the current topology and the plan in force.

    Use: `ingest` messages, `advance` to now, read `belief`, `estimates`, `setpoints`; plan with `plan`, or with
    `request`, `planner.plan` on another thread, and `adopt`. clock: id of the boot clock that `now_ns` is read from.
    """

    def __init__(self, parameters: TrackerParameters, clock: str, epoch: int = 0) -> None:
        self.parameters = parameters
        self.planner = Planner(parameters.planner, parameters.sensors)
        self.filter = FixedLagFilter(parameters.estimator)
        self.epoch = epoch
        self._clock = clock
        self.holding = frozenset[str]()
        self.current: PlanResult | None = None
        self.rejected: Counter[str] = Counter()
        self._intake = Intake(self.filter, parameters.estimator.sensors, clock)
        self.mounts = MountWatch(parameters.estimator)
        self._joinings = Joinings()
        self._localisation = Localisation(parameters.safety)
        self._hovering = Hovering(parameters.control.fed, parameters.safety)
        self._shafts = Shafts(parameters.estimator, parameters.safety)
        self._topology = Topology(())
        self._plans = PlanWatch(parameters.control.max_plan_age_s)
        self._drifts: defaultdict[str, DriftWatch] = defaultdict(DriftWatch)
        self._belief = self.filter.belief()
        self._unlocalised_s: Mapping[str, float] = {}
        self._corrections: list[Correction] = []
        self._notices: list[Notice] = []
        self._modes: Mapping[str, FlightMode] = {}
        self._robots = tuple(n for n, m in parameters.estimator.entities.items() if m.kind is EntityKind.ROBOT)
        self._targets = tuple(n for n, m in parameters.estimator.entities.items() if m.kind is EntityKind.TARGET)
        self.lookout = Lookout(parameters.search, parameters.control, parameters.sensors, self._robots, self._targets)
        links = [one.carrier for one in parameters.estimator.sensors.values() if isinstance(one, RangeSensor)]
        self._roots = RootWatch(self.mounts.roots, self._robots + self._targets, links)

    @property
    def robots(self) -> tuple[str, ...]:
        """Return the names of all robots that may join."""
        return self._robots

    @property
    def airborne(self) -> tuple[str, ...]:
        """Return the robots that fly, by their vehicles' status."""
        return tuple(name for name in self._robots if self.filter.airborne(name))

    @property
    def belief(self) -> JointBelief:
        """Return the belief at the time of the last `advance`."""
        return self._belief

    @property
    def topology(self) -> Topology:
        """Return the topology in force over the airborne robots that have joined."""
        return self._topology

    def ingest(self, key: str, message: Message, now_ns: int) -> Verdict | None:
        """Take one message that came under a key; return why it was refused, or None if it may count.

        Never raises for the content of a message. Refused observations are also among `take_corrections`.
        """
        moved = self.mounts.distrusts(message.header.entity)
        refused = moved and isinstance(message, RelativeObservation)
        verdict = Verdict.IMPLAUSIBLE if refused else self._intake.take(key, message, now_ns)
        if not moved and verdict is not Verdict.IMPLAUSIBLE:
            self.lookout.take(message, verdict is Verdict.ACCEPTED, message.header.clock == self._clock)
            if isinstance(message, VehicleStatus):
                self._hovering.take(message, now_ns)
                self._shafts.hear(message, now_ns)
        if verdict is Verdict.ACCEPTED:
            if not moved:
                self._roots.take(message, now_ns)
                self._shafts.see(message, now_ns)
            if isinstance(message, RelativeObservation) and message.header.clock == self._clock:
                self.mounts.see(message)
                self.lookout.see(message)
            return None
        self.rejected[f"{type(message).__name__} {verdict}"] += 1
        if verdict is Verdict.FROZEN:
            self._roots.hear_frozen(message)
        if isinstance(message, RelativeObservation):
            reason, latency_ms = MOVED if moved else REASONS[verdict], (now_ns - message.header.stamp_ns) / 1e6
            self._corrections.append(
                Correction(message.observer, message.subject, verdict, reason, latency_ms=latency_ms)
            )
        return verdict

    def advance(self, now_ns: int) -> JointBelief:
        """Advance the belief to `now_ns`; one that is no longer a distribution is dropped, with a notice."""
        self.filter.advance(now_ns)
        if not self.filter.is_sound():
            self._fault("the belief is not a distribution any more")
        self._belief = self.filter.belief()
        outcomes = self.filter.take_corrections()
        self._intake.reports.advance(now_ns, outcomes)
        corrections = [one for one in outcomes if not one.is_report]
        self._corrections += corrections
        ranged = self._intake.ranges.take_joined()
        self._notices += self._joinings.take(now_ns, corrections, ranged)
        velocities = {name: self.filter.velocity_of(name) for name in self._belief.layout.robots}
        self._shafts.advance(self._belief, velocities)
        self._notices += self.mounts.advance(now_ns, velocities, corrections, self.airborne)
        self._notices += self._roots.advance(now_ns, corrections, ranged, flying=bool(self.airborne))
        self._notices += self._intake.reports.take_notices()
        self._heed_absence(now_ns)
        self._topology = self._topology_now()
        self.holding &= {name for name in self.airborne if not self.converged(name)}
        planned_ns = None if self.current is None else self.current.stamp_ns
        self._notices += self._plans.advance(now_ns, planned_ns, flying=bool(self.airborne))
        self._unlocalised_s = self._find_unlocalised()
        return self._belief

    def take_corrections(self) -> list[Correction]:
        """Return and forget the results of the observations since the last call."""
        corrections, self._corrections = self._corrections, []
        return corrections

    def take_notices(self) -> list[Notice]:
        """Return and forget the notices for the operator."""
        notices, self._notices = self._notices, []
        return notices

    def converged(self, name: str) -> bool:
        """Return whether an entity is known well enough to fly on; without a world-fixed sensor none is."""
        if name not in self._belief.layout or self.mounts.is_rootless or self._roots.is_silent:
            return False
        # For a robot that flies on our estimate the deviation accounts for its velocity error while unseen (0214).
        fed = name in self.parameters.control.fed
        settled = fed or not self._joinings.is_unsettled(name)
        return settled and self._localisation.holds(self._belief, name, 0.0 if fed else self._tied_age_s(name))

    def estimates(self) -> tuple[EntityEstimate, ...]:
        """Return the estimate of each entity that has joined."""
        names, ages_s = self._belief.layout.robots + self._belief.layout.targets, self.unlocalised_s()
        told = {name: (self.converged(name), self._tied_age_s(name), ages_s.get(name, 0.0)) for name in names}
        return tuple(entity_estimate(self.filter, self._belief, name, *known) for name, known in told.items())

    def target_age_s(self) -> float | None:
        """Return the time since any target was last observed [s]; None if none is in the belief."""
        age = min((self.filter.age_s(name) for name in self._targets), default=math.inf)
        return age if math.isfinite(age) else None

    def unlocalised_s(self) -> Mapping[str, float]:
        """Return for how long each airborne robot may have been elsewhere than estimated [s]; infinite: never seen.

        A robot known well enough and missed by no camera is localised, even if seen long ago; but odometry is
        trusted no longer than for twice the time within which a robot flies back.
        """
        return self._unlocalised_s

    def _find_unlocalised(self) -> dict[str, float]:
        missed, trusted_s = self.lookout.missed_s, 2.0 * self.parameters.control.return_within_s
        ages_s = {name: self.filter.age_s(name) for name in self.airborne}
        return {
            name: 0.0
            if self.converged(name) and name not in missed and age_s <= trusted_s
            else self._rooted_age_s(name)
            for name, age_s in ages_s.items()
        }

    def _tied_age_s(self, name: str) -> float:
        """Return the time [s] since an entity was seen, or saw one located by a world-fixed sensor; or infinity."""
        return min(self.filter.age_s(name), self._roots.age_s(name))

    def _rooted_age_s(self, robot: str) -> float:
        """Return the time [s] since a sensor fixed in the room last located a robot; infinite if it has not joined."""
        return max(self.filter.age_s(robot), self._roots.age_s(robot))

    def _heed_absence(self, now_ns: int) -> None:
        """Use pictures that do not show entities: an entity missing at its estimated place leaves the belief."""
        ages_s = {name: self.filter.age_s(name) for name in (*self.airborne, *self._targets)}
        rooted_s = {name: self._rooted_age_s(name) for name in self.airborne}
        unlocalised = [name for name, unknown_s in self._unlocalised_s.items() if unknown_s > 0.0]
        gone = self.lookout.advance(self._belief, ages_s, rooted_s, unlocalised)
        self._notices += self.lookout.take_notices()
        for name in gone:
            for present in (False, True):
                self.filter.set_present(name, present, now_ns, now_ns)
        if gone:
            self.filter.advance(now_ns)
            self._belief = self.filter.belief()

    def request(self) -> PlanRequest:
        """Return the snapshot for the next plan."""
        warm = {} if self.current is None else self.current.warm_start
        belief = self._belief.core(without=self.lookout.hopeless(self._belief))
        return PlanRequest(belief, self._topology, warm, self.lookout.held)

    def adopt(self, plan: PlanResult) -> None:
        """Put a finished plan in force, for those of its robots that still fly."""
        self.current = plan
        self._topology = plan.topology
        self._topology = self._topology_now()

    def plan(
        self, should_stop: Callable[[], bool] = lambda: False, max_evaluations: int | None = None
    ) -> PlanResult | None:
        """Plan on the belief and adopt the plan; None when planning failed and the last plan stays."""
        request = self.request()
        try:
            plan = request.put_to(self.planner, should_stop, max_evaluations)
        except EstimatorFault as fault:
            self._fault(str(fault))
            return None
        self.adopt(plan)
        return plan

    def setpoints(self, now_ns: int) -> dict[str, Limited]:
        """Return each airborne robot's setpoint, limited by the newest belief; robots of unknown place hover."""
        p, airborne = self.parameters, self.airborne
        belief, plan = self._belief.core(), self.current
        stale = self._plans.is_stale(now_ns)
        if plan is not None and stale:
            plan = plan.halted(belief)  # ways back and searches need none
        velocities = {name: np.array(self.filter.velocity_of(name)) for name in belief.layout.robots}
        drifts = {
            name: self._drifts[name].see(now_ns, belief.mean_of(name)[:3] + p.safety.reaction_s * velocity)
            for name, velocity in velocities.items()
        }
        sight = self._sight(belief, velocities, drifts)
        wanted = setpoints_from_plan(plan, belief, airborne, p.control, p.sensors, sight)
        self._modes = {name: one.phase for name, one in wanted.items()}
        sure = (n for n, age_s in self.unlocalised_s().items() if age_s == 0.0 and not self.filter.contradicted(n))
        sure_s = {name: self._tied_age_s(name) for name in sure}
        safety, shafts = self._hovering.within(p.safety), self._shafts.around(belief, airborne)
        limited = {
            name: limit_setpoint(name, setpoint, belief, now_ns, safety, velocities, drifts, shafts)
            for name, setpoint in self._hovering.held(wanted, now_ns, belief, sure_s).items()
        }
        limited = self._hovering.sent(limited, sure_s) | {name: Limited(HOVER, ("hold",)) for name in self.holding}
        for name, entry in limited.items() if stale else ():
            if entry.setpoint.phase is FlightMode.TRACK:
                limited[name] = replace(entry, limited_by=(*entry.limited_by, "stale plan"))
        self._note_commands(belief, {name: entry for name, entry in limited.items() if name in drifts})
        return limited

    def _sight(self, belief: JointBelief, velocities: Mapping[str, Array], drifts: Mapping[str, Array]) -> Sight:
        lookout, robots = self.lookout, belief.layout.robots
        seen_s = (self.filter.age_s(name) for name in self._targets if name not in lookout.missing)
        return Sight(
            min(seen_s, default=None), {name: self.filter.age_s(name) for name in robots}, lookout.missed_s,
            lookout.missing, lambda robots, targets: lookout.stands(robots, targets, belief),
            lookout.velocity_errors_m_s, drifts, lookout.unsteered, {n: self._tied_age_s(n) for n in robots},
            velocities, {n: self._roots.helped_age_s(n) for n in robots}, self._modes, lookout.blind)  # fmt: skip

    def _note_commands(self, belief: JointBelief, sent: Mapping[str, Limited]) -> None:
        """Note the velocities that robots fly from now on, to tell a drift from what was commanded."""
        for name, entry in sent.items():
            is_obeyed = entry.holds or name not in self.lookout.unmoved
            velocity = np.array(entry.setpoint.velocity_m_s) if is_obeyed else np.zeros(3)
            self._drifts[name].note_command(world_from_stabilized(velocity, float(belief.mean_of(name)[3])))

    def _topology_now(self) -> Topology:
        flying = [name for name in self._belief.layout.robots if self.filter.airborne(name)]
        if not self._topology.levels:
            return (Topology.string if self.parameters.string_first else Topology.flat)(flying)
        return self._topology.reconciled(flying)

    def _fault(self, text: str) -> None:
        """Drop the belief, hover, and begin a new epoch: drivers then move again only after an operator's RESUME."""
        self.filter.restart()
        self.holding = frozenset(self.airborne)
        self.current, self._plans = None, PlanWatch(self.parameters.control.max_plan_age_s)
        self.epoch += 1
        self._unlocalised_s = self._find_unlocalised()
        remedy = "drones hover; RESUME once they are localised again, or land them"
        self._notices.append(Notice(Severity.ERROR, f"estimator fault: {text}", remedy))
