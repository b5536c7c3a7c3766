"""Times one control step of the planner, of brute force and of its peers on the same beliefs, interleaved."""

import time
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from groundstation.bench.planner_peer_process import PeerProcess, peak_memory_mb
from groundstation.experiments.planar.parameters import PlanarParameters
from groundstation.experiments.planar.planner import Fate, PlanarPlan, PlanarPlanner, SearchOptions
from groundstation.experiments.planar.scenarios import bench_belief

# Beliefs, candidates and tolerance are the same for all; `wide` alone adds the radial cuts and merges.
OURS = {
    "certified": SearchOptions(wide=False),
    "certified-wide": SearchOptions(),
    "brute-force": SearchOptions(wide=False, prune=False),
}
SAME_COST = 0.01  # peers solve from rest and may end in another local optimum: theirs counts as the same within 1 %
_FIRST_ROBOTS = 10  # exponents are fitted from here on: below, constant overheads dominate


@dataclass(slots=True)
class Case:
    """One unfinished row: a method on a belief."""

    robots: int
    layout: str
    method: str
    cpu_ms: list[float] = field(default_factory=list)
    row: dict[str, Any] = field(default_factory=dict)

    def finished(self) -> dict[str, Any]:
        """Return the row of the JSON."""
        times = self.cpu_ms
        return {
            "robots": self.robots,
            "layout": self.layout,
            "method": self.method,
            "cpu_ms_median": float(np.median(times)) if times else None,
            "cpu_ms_min": min(times, default=None),
            "cpu_ms_max": max(times, default=None),
            "repeats": len(times),
            **self.row,
        }


def run_bench(
    robots: Sequence[int],
    layouts: Sequence[str],
    peers: Sequence[str] = (),
    repeats: int = 9,
    seed: int = 3,
    limit_s: float = 20.0,
    tell: Callable[[str], None] = lambda text: None,
) -> dict[str, Any]:
    """Return {"rows": [...], "exponent": {layout: {method: slope}}, ...}; every round runs each case once."""
    parameters = PlanarParameters()
    cases = [Case(n, layout, method) for layout in layouts for n in robots for method in (*OURS, *peers)]
    planners = {(n, method): PlanarPlanner(n, parameters, options) for n in robots for method, options in OURS.items()}
    with ExitStack() as stack:
        processes = {name: stack.enter_context(PeerProcess(name, limit_s)) for name in peers}
        for turn in range(repeats):
            for case in cases:
                tell(f"round {turn + 1} of {repeats}: {case.layout}, {case.robots} robots, {case.method}")
                if case.method in OURS:
                    _time_ours(case, planners[case.robots, case.method], seed, parameters)
                else:
                    _time_peer(case, processes[case.method], turn, seed, parameters)
    _compare(cases)
    rows = [case.finished() for case in cases]
    return {"rows": rows, "exponent": exponents(rows), "seed": seed, "parameters": _describe(parameters)}


def _time_ours(case: Case, planner: PlanarPlanner, seed: int, parameters: PlanarParameters) -> None:
    """Time one step from rest, after an untimed one: the case before has left the caches full of its own data."""
    mean, covariance, level = bench_belief(case.robots, case.layout, seed, parameters)
    planner.reset()
    planner.plan(mean, covariance, level)
    planner.reset()
    before = time.process_time()
    plan = planner.plan(mean, covariance, level)
    case.cpu_ms.append(1e3 * (time.process_time() - before))
    case.row = _ours(plan)


def _ours(plan: PlanarPlan) -> dict[str, Any]:
    return {
        "topologies": len(plan.certificate),
        "survivors": plan.certificate.count(Fate.SOLVED),
        "evaluations": plan.evaluations,
        "cost": plan.cost,
        "extrapolated": False,
        "peak_memory_mb": peak_memory_mb(),
        "failure": "",
    }


def _time_peer(case: Case, process: PeerProcess, turn: int, seed: int, parameters: PlanarParameters) -> None:
    """Time one step; slow, extrapolated and failed cases are not repeated, which would not improve them."""
    slow = case.cpu_ms and max(case.cpu_ms) > 1e3 * process.limit_s / 4
    if turn > 0 and (slow or case.row.get("extrapolated") or case.row.get("failure")):
        return
    measured = process.measure(case.robots, case.layout, seed, parameters)
    if measured is None:
        unknown = dict.fromkeys(("topologies", "survivors", "evaluations", "cost", "peak_memory_mb"))
        case.row = case.row or {**unknown, "extrapolated": False, "failure": process.failure}
        return
    case.cpu_ms.append(measured.cpu_ms)
    case.row = {
        "topologies": measured.topologies,
        "survivors": measured.topologies,
        "evaluations": measured.evaluations,
        "cost": measured.cost,
        "extrapolated": measured.extrapolated,
        "peak_memory_mb": measured.peak_memory_mb,
        "failure": "",
    }


def _compare(cases: list[Case]) -> None:
    """Fill in `matches_brute_force`: the same cost to the last bit for ours, within SAME_COST for peers."""
    brute = {(case.robots, case.layout): case.row["cost"] for case in cases if case.method == "brute-force"}
    for case in cases:
        cost, best = case.row.get("cost"), brute[case.robots, case.layout]
        if cost is None:
            case.row["matches_brute_force"] = None
        elif case.method == "certified-wide":
            case.row["matches_brute_force"] = bool(cost <= best)
        else:
            tolerance = 0.0 if case.method in OURS else SAME_COST
            case.row["matches_brute_force"] = bool(abs(cost - best) <= tolerance * best)


def exponents(rows: Sequence[dict[str, Any]]) -> dict[str, dict[str, float]]:
    """Return the slope of log time over log robots per layout and method, from 10 robots on and measured rows only."""
    found: dict[str, dict[str, float]] = {}
    for layout in dict.fromkeys(row["layout"] for row in rows):
        for method in dict.fromkeys(row["method"] for row in rows):
            points = [
                (row["robots"], row["cpu_ms_median"])
                for row in rows
                if (row["layout"], row["method"]) == (layout, method)
                and row["robots"] >= _FIRST_ROBOTS
                and row["cpu_ms_median"] is not None
                and not row["extrapolated"]
            ]
            if len({n for n, _ in points}) >= 2:
                x, y = np.log(np.array(points)).T
                found.setdefault(layout, {})[method] = float(np.polyfit(x, y, 1)[0])
    return found


def _describe(parameters: PlanarParameters) -> dict[str, Any]:
    return {name: getattr(parameters, name) for name in PlanarParameters.__slots__}
