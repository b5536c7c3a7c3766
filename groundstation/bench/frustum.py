"""Times control steps of the planner that flies, on fresh beliefs and on those of a team in flight."""

import itertools
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from groundstation.bench.frustum_team import FrustumTeam, settled
from groundstation.estimation.belief import JointBelief
from groundstation.planning.planner import Planner
from groundstation.planning.time_budget import TimeBudget
from groundstation.sensing.topology import Topology


@dataclass(frozen=True, slots=True)
class _Moment:
    """Input of a step, with a planner of its own, so that none remembers another's topology."""

    planner: Planner
    belief: JointBelief
    topology: Topology
    warm_start: dict[str, Any] | None


# Of a step in flight.
_BUDGET_MS = 40.0


def run_frustum_bench(
    robots: Sequence[int],
    layouts: Sequence[str],
    repeats: int = 9,
    seed: int = 3,
    running_s: float = 8.0,
    tell: Callable[[str], None] = lambda text: None,
) -> dict[str, Any]:
    """Return {"rows": [...]}: a row for each team, layout and kind of belief.

    Each repeat is another moment: of another fresh team, or the next step of one that has flown for running_s.
    cpu_ms: of complete steps; over_ms: largest excess of a step's wall time over its budget.
    """
    rows = []
    for layout, n, belief in itertools.product(layouts, robots, ("fresh", "running")):
        tell(f"{layout}, {n} robots, {belief}")
        figures = _row(n, layout, running_s if belief == "running" else 0.0, repeats, seed)
        rows.append({"robots": n, "layout": layout, "belief": belief, **figures})
    return {"rows": rows, "seed": seed, "budget_ms": _BUDGET_MS, "running_s": running_s}


def _row(n: int, layout: str, running_s: float, repeats: int, seed: int) -> dict[str, Any]:
    running = settled(n, layout, seed, running_s) if running_s else None
    cpu_ms, over_ms, gaps, solvers, shares = [], [], [], [], []
    for turn in range(repeats):
        team = running or FrustumTeam(n, layout, seed + turn)
        moment = _Moment(team.planner, team.belief, team.topology, team.warm_start)
        before = time.process_time()
        plan = moment.planner.plan(moment.belief, moment.topology, moment.warm_start, lambda: False)
        cpu_ms.append(1e3 * (time.process_time() - before))
        over_ms.append(_over(moment))
        gaps.append(plan.solver.gap or 0.0)
        solvers.append(plan.solver)
        shares.append(plan.solver.survivors / plan.solver.topologies)
        if running:
            running.fly(plan)
    return {
        "cpu_ms_median": float(np.median(cpu_ms)),
        "cpu_ms_p99": float(np.quantile(cpu_ms, 0.99)),
        "over_ms": max(over_ms),
        "topologies": solvers[-1].topologies,
        "solved": float(np.median(shares)),
        "evaluations": int(np.median([solver.evaluations for solver in solvers])),
        "gap": float(np.median(gaps)),
        "repeats": repeats,
    }


def _over(moment: _Moment) -> float:
    """Return the excess of a step's time over the budget [ms]."""
    budget = TimeBudget(1e-3 * _BUDGET_MS, time.perf_counter)
    moment.planner.plan(moment.belief, moment.topology, moment.warm_start, budget.must_stop)
    return 1e3 * (time.perf_counter() - budget.deadline)
