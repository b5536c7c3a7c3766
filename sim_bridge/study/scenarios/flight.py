"""One flight of a scenario: the campaign's, with the file's target, surroundings and faults, and other figures."""

from collections.abc import Iterator, Sequence
from typing import Any

from groundstation.bus.messages import Message
from sim_bridge.fault_kinds import FaultKind
from sim_bridge.link_bursts import with_bursts
from sim_bridge.scenario import Scenario
from sim_bridge.scenario_fit import misfits
from sim_bridge.site import parse_site
from sim_bridge.study.faults.draw import Drawn
from sim_bridge.study.faults.flight import DOWN, JUDGE_S, FaultFlight
from sim_bridge.study.faults.flight_order import WrongOrder
from sim_bridge.study.faults.hosted_kinds import unbroken
from sim_bridge.study.faults.judge import FELL_M_S, OBSTACLE_M
from sim_bridge.study.faults.vehicles import Section
from sim_bridge.study.scenarios.figures import SEPARATION_M, TrackingErrors, shortfalls
from sim_bridge.study.scenarios.first_program import along_an_edge
from sim_bridge.study.scenarios.strategies import STRATEGIES
from sim_bridge.study.wrong_figures import WrongFigures
from sim_bridge.surroundings import ScenarioExpectation


def as_drawn(field: dict[str, Any], scenario: Scenario, seed: int) -> Drawn:
    """Return the flight of a seed; raises WrongOrder if the scenario does not fit, or has faults that break nothing."""
    if refusal := unbroken(scenario.faults):
        raise WrongOrder(refusal)
    drones, site = field["drones"], parse_site(field)
    if unfit := misfits(scenario, site, (*site.cameras, *drones)):
        raise WrongOrder("\n".join(map(str, unfit)))
    return Drawn(field, with_bursts(scenario, drones, drones, seed), seed)


class ScenarioFlight(FaultFlight):
    """A flight of a scenario under a strategy; `run` returns its figures."""

    def __init__(
        self,
        drawn: Drawn,
        sections: Sequence[Section],
        seconds: float,
        strategy: str,
        wrong: WrongFigures | None = None,
    ) -> None:
        chosen = STRATEGIES[strategy]
        super().__init__(drawn, sections, seconds, chosen.planner_of, wrong)
        self._strategy, self._edges_only = strategy, chosen.edges_only
        self._errors = TrackingErrors(JUDGE_S)
        self._switches, self._topology = 0, ""

    def heeds(self, message: Message) -> bool:
        """Return whether the strategy fuses a message; until the team tracks, all are."""
        if not (self._edges_only and self._topology):
            return True
        return along_an_edge(message, self.tracking.tracker.topology, self.world.targets)

    def watch(self) -> None:
        """Compare the estimated places of the targets with the truth."""
        world = self.world
        truth = dict(zip(world.bodies, world.states(), strict=True))
        self._errors.take(truth, {name: self.believed(name) for name in world.targets})
        topology = str(self.tracking.tracker.topology)
        self._switches += bool(self._topology) and topology != self._topology
        self._topology = topology

    def figures(self) -> dict[str, Any]:
        """Return the flight's figures."""
        judge = self.judge
        violations = [f"fence {judge.fence_m:.2f} m"] * (judge.fence_m > 0.0)
        violations += [f"obstacle {judge.obstacle_m:.2f} m"] * (judge.obstacle_m < OBSTACLE_M)
        violations += [f"separation {judge.separation_m:.2f} m"] * (judge.separation_m < SEPARATION_M)
        violations += [f"{name} fell at {sinking:.1f} m/s" for name, sinking in self._falls()]
        figures = {
            **self._errors.figures(),
            "landings": sum(mode in DOWN for mode in self.modes().values()),
            "violations": violations,
            "switches": self._switches,
        }
        expected = self.scenario.expected or ScenarioExpectation()
        missed = shortfalls(figures, expected)
        return {**figures, "missed": [*missed, *filter(None, [self.planning.failed])]}

    def _falls(self) -> Iterator[tuple[str, float]]:
        """Yield drones that fell, and how fast [m/s]; one whose propeller the file blocks only came down."""
        blocked = {fault.entity for fault in self.scenario.faults if fault.kind is FaultKind.PROPELLER_BLOCKED}
        for name, sinking_m_s in self.judge.sinking_m_s.items():
            if sinking_m_s > FELL_M_S and name not in blocked:
                yield name, sinking_m_s

    def fly(self) -> dict[str, Any]:
        """Fly to the end; returns seed, strategy, figures and the time spent."""
        report = self.run()
        flown = report["tracking_since_s"] is not None
        nothing: dict[str, Any] = {"missed": ["did not take off"]}
        return {
            "seed": report["seed"],
            "strategy": self._strategy,
            "flown": flown,
            **(self.figures() if flown else nothing),
            "reasons": {n: r for n, r in report["reasons"].items() if report["modes"][n] in DOWN},
            "planning": report["planning"],
            "spent_s": report["spent_s"],
        }
