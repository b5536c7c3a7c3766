"""Times the joint filter, filterpy and dense numpy on the same team, and the product's path from bytes to bytes.

CPU time; every round restores the state, so that all rounds do the same, and times every filter once; the least of all
rounds counts, because other programs on a machine only ever add to it.
"""

import os
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from groundstation.bench.estimator_path import fly
from groundstation.bench.estimator_peers import FILTERPY_MISSING, Contestant, Ours, contestants, difference
from groundstation.bench.estimator_team import (
    CAMERA_HZ,
    ODOMETRY_HZ,
    BenchTeam,
    frame_of,
    joined_state,
    minimal_parameters,
    product_parameters,
    team_of,
)
from groundstation.estimation.records import ACCEPTED
from groundstation.field.resolved import ResolvedField

Tell = Callable[[str], None]
SAME_BELIEF = 1e-9
JUDGED_ROBOTS, LATE_MS = 30, 120
LIMITS = {
    "predict_us": 5.0,
    "correct_us_per_edge": 6.0,
    "filterpy_to_ours": 40.0,
    "path_us_per_observation": 60.0,
    "path_as_flown_us": 60.0,
    "path_as_flown_heights_us": 60.0,
    "late_to_in_order": 3.0,
}
_AT_LEAST = ("filterpy_to_ours",)
_TICKS = ODOMETRY_HZ // CAMERA_HZ  # between two frames
_OURS = "ours"


@dataclass(slots=True)
class LeastTime:
    """The least CPU time of one filter [us]."""

    predict_us: float = np.inf
    correct_us: float = np.inf

    def add(self, filter_: Contestant, events: Any, ticks: int) -> None:
        """Time some ticks and one frame."""
        before = time.process_time()
        filter_.predict(1.0 / ODOMETRY_HZ, ticks)
        middle = time.process_time()
        filter_.correct(events)
        after = time.process_time()
        self.predict_us = min(self.predict_us, 1e6 * (middle - before) / ticks)
        self.correct_us = min(self.correct_us, 1e6 * (after - middle) / len(events))

    def cores(self, edges: int) -> float:
        """Return the share of a core that the team needs at the rates of its sensors."""
        return 1e-6 * (ODOMETRY_HZ * self.predict_us + CAMERA_HZ * edges * self.correct_us)


def run_bench(
    robots: Sequence[int],
    resolved: ResolvedField,
    rounds: int = 30,
    duration_ms: int = 1000,
    seed: int = 1,
    tell: Tell = lambda text: None,
) -> dict[str, Any]:
    """Return {"kernels": [...], "path": [...], "same_belief": {...}, "targets": {...}, "missing": [...], "load"}.

    resolved: the field whose first drone and camera the product's blocks are copied from.
    """
    kernels: list[dict[str, Any]] = []
    paths: list[dict[str, Any]] = []
    same: dict[str, dict[str, float]] = {}
    for count in robots:
        teams = {"minimal": team_of(minimal_parameters(count)), "product": team_of(product_parameters(count, resolved))}
        same[str(count)] = same_belief(teams["minimal"], seed)
        for blocks, team in teams.items():
            tell(f"{count} robots, {blocks} blocks: kernels")
            about = {"robots": count, "blocks": blocks, "dim": team.tables.dim, "edges": len(team.edges)}
            kernels += [about | row for row in _kernel_rows(team, blocks == "minimal", rounds, seed)]
            tell(f"{count} robots, {blocks} blocks: path")
            paths += [about | row for row in _path_rows(team, blocks == "product", duration_ms, seed)]
    result = {"kernels": kernels, "path": paths, "same_belief": same}
    missing = [] if any(row["method"] == "filterpy" for row in kernels) else [FILTERPY_MISSING]
    return result | {"targets": targets(result), "missing": missing, "load": list(os.getloadavg()), "seed": seed}


def same_belief(team: BenchTeam, seed: int) -> dict[str, float]:
    """Return each peer's difference from ours after two frames and the ticks before them; raises if ours refused any.

    `numpy-batch` linearises a whole frame at one point and so differs by more than rounding.
    """
    rng = np.random.default_rng(seed)
    state, events = joined_state(team, rng), [frame_of(team, rng) for _ in range(2)]
    peers, ours = contestants(team, state), Ours(team, state)
    for frame in events:
        ours.predict(1.0 / ODOMETRY_HZ, _TICKS)
        ours.correct(frame)
        if (ours.outcomes["verdict"] != ACCEPTED).any():
            raise RuntimeError("the bench's own frame was not accepted: the filters cannot be compared")
        for peer in peers.values():
            peer.predict(1.0 / ODOMETRY_HZ, _TICKS)
            peer.correct(frame)
    return {name: difference(ours, peer) for name, peer in peers.items()}


def _kernel_rows(team: BenchTeam, with_peers: bool, rounds: int, seed: int) -> list[dict[str, Any]]:
    rng = np.random.default_rng(seed)
    start, events = joined_state(team, rng), frame_of(team, rng)
    timed = {_OURS: LeastTime()} | ({name: LeastTime() for name in contestants(team, start)} if with_peers else {})
    for _ in range(rounds):
        state = joined_state(team, np.random.default_rng(seed))
        filters = contestants(team, state) if with_peers else {}
        for name, filter_ in filters.items():
            timed[name].add(filter_, events, 2)
        ours = Ours(team, state)
        ours.predict(1.0 / ODOMETRY_HZ, 2)
        timed[_OURS].add(ours, events, 20)
    ours_cores = timed[_OURS].cores(len(events))
    return [
        {
            "method": name,
            "predict_us": row.predict_us,
            "correct_us": row.correct_us,
            "cores": row.cores(len(events)),
            "times_ours": row.cores(len(events)) / ours_cores,
        }
        for name, row in timed.items()
    ]


def _path_rows(team: BenchTeam, product: bool, duration_ms: int, seed: int) -> list[dict[str, Any]]:
    rows: list[dict[str, Any]] = []
    for heights in (False, True) if product else (False,):
        in_order, late = (
            min((fly(team, duration_ms, late_ms, heights, seed) for _ in range(2)), key=_cost)
            for late_ms in (0, LATE_MS)
        )
        rows += [in_order | {"to_in_order": 1.0}, late | {"to_in_order": _cost(late) / _cost(in_order)}]
    return rows


def _cost(row: Mapping[str, Any]) -> float:
    return float(row["us_per_observation"])


def targets(result: Mapping[str, Any]) -> dict[str, dict[str, Any]]:
    """Return {name: {"limit", "value", "met"}} for 30 robots; nothing when they were not run.

    Kernels and the path with minimal blocks; `path_as_flown_us` and `path_as_flown_heights_us` with the product's, in
    order, without and with heights.
    """
    kernels = {row["method"]: row for row in result["kernels"] if _is_judged(row, "minimal")}
    paths = [row for row in result["path"] if _is_judged(row, "minimal")]
    if not kernels:
        return {}
    values = {
        "predict_us": kernels[_OURS]["predict_us"],
        "correct_us_per_edge": kernels[_OURS]["correct_us"],
        "path_us_per_observation": _cost(paths[0]),
        "late_to_in_order": paths[1]["to_in_order"],
    }
    in_order = [row for row in result["path"] if _is_judged(row, "product") and row["delay_ms"] == 0]
    for row in in_order:
        values["path_as_flown_heights_us" if row["heights"] else "path_as_flown_us"] = _cost(row)
    if "filterpy" in kernels:
        values["filterpy_to_ours"] = kernels["filterpy"]["times_ours"]
    return {
        name: {
            "limit": limit,
            "value": values[name],
            "met": values[name] >= limit if name in _AT_LEAST else values[name] <= limit,
        }
        for name, limit in LIMITS.items()
        if name in values
    }


def _is_judged(row: Mapping[str, Any], blocks: str) -> bool:
    return bool(row["robots"] == JUDGED_ROBOTS and row["blocks"] == blocks)
