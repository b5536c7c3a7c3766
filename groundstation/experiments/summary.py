"""Figures of merit over seeds: medians, shares and ratios to the paper's heuristic, as the JSON summary holds them."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

import numpy as np

_GROUP = ("experiment", "robots", "strategy", "start")


def summarise(rows: Sequence[dict[str, Any]]) -> list[dict[str, Any]]:
    """Return one entry per group of equal experiment, team, strategy and start, in order of first appearance."""
    return _by_group(rows, _merits)


def timings(rows: Sequence[dict[str, Any]]) -> list[dict[str, Any]]:
    """Return the CPU times of a decision per group; kept apart, because they differ from run to run."""
    return _by_group(rows, _times)


def _by_group(rows: Sequence[dict[str, Any]], figures: Callable[[list[dict[str, Any]]], dict[str, Any]]) -> list[Any]:
    groups: dict[tuple[Any, ...], list[dict[str, Any]]] = {}
    for row in rows:
        groups.setdefault(tuple(row["task"][name] for name in _GROUP), []).append(row)
    return [{**dict(zip(_GROUP, key, strict=True)), **figures(members)} for key, members in groups.items()]


def _merits(rows: Sequence[dict[str, Any]]) -> dict[str, Any]:
    merits = [row["merits"] for row in rows]
    rmse, worst = [m["rmse_m"] for m in merits], [m["max_error_m"] for m in merits]
    entry = {
        "seeds": len(rows),
        "mean_trace_m2": float(np.mean([m["mean_trace_m2"] for m in merits])),
        "rmse_m_median": float(np.median(rmse)),
        "rmse_m_worst": float(max(rmse)),
        "max_error_m_median": float(np.median(worst)),
        "lost_runs": sum(m["lost"] for m in merits),
        "switches_mean": float(np.mean([m["switches"] for m in merits])),
        "levels_last_mean": float(np.mean([m["levels_last"] for m in merits])),
        "readings_per_step": float(np.mean([m["readings_per_step"] for m in merits])),
        "consistency": float(np.mean([m["consistency"] for m in merits])),
    }
    if "as_in_the_paper" in merits[0]:
        entry["as_in_the_paper"] = sum(m["as_in_the_paper"] for m in merits)
        two = [m["decisions_to_two_levels"] for m in merits]
        entry["two_levels_within_3_decisions"] = sum(k is not None and k <= 3 for k in two)
        shares = [m["share_three_levels_beyond_1_5_m"] for m in merits]
        entry["three_levels_beyond_1_5_m"] = sum(s is not None and s > 0.9 for s in shares)
    return entry


def add_ratios(entries: Sequence[dict[str, Any]]) -> None:
    """Add to each entry its mean trace over that of the paper's strategy with equal team and start.

    A fixed topology has no start of its own: it is compared with the paper's string start.
    """
    for entry in entries:
        for other in entries:
            start = "string" if entry["strategy"].startswith("fixed") else entry["start"]
            if (other["strategy"], other["robots"], other["start"]) == ("paper", entry["robots"], start):
                entry["trace_ratio_to_paper"] = entry["mean_trace_m2"] / other["mean_trace_m2"]


def _times(rows: Sequence[dict[str, Any]]) -> dict[str, Any]:
    times = [row["timing"] for row in rows]
    return {
        "cpu_ms_median": float(np.median([one["cpu_ms_median"] for one in times])),
        "cpu_ms_p99_worst": float(max(one["cpu_ms_p99"] for one in times)),
    }


def worst(flights: Iterable[Mapping[str, Any]], key: str, pick: Any) -> float | None:
    """Return the least or largest (pick: min or max) value of flights under a key, None if no flight has one."""
    found = [flight[key] for flight in flights if flight[key] is not None]
    return pick(found) if found else None
