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

    def each(figure: str) -> list[Any]:
        return [one[figure] for one in merits]

    entry = {
        "seeds": len(rows),
        "mean_trace_m2": float(np.mean(each("mean_trace_m2"))),
        "rmse_m_median": float(np.median(each("rmse_m"))),
        "rmse_m_worst": float(max(each("rmse_m"))),
        "max_error_m_median": float(np.median(each("max_error_m"))),
        "lost_runs": sum(each("lost")),
        "switches_mean": float(np.mean(each("switches"))),
        "levels_last_mean": float(np.mean(each("levels_last"))),
        "readings_per_step": float(np.mean(each("readings_per_step"))),
        "consistency": float(np.mean(each("consistency"))),
    }
    if "as_in_the_paper" in merits[0]:
        entry["as_in_the_paper"] = sum(each("as_in_the_paper"))
        entry["two_levels_within_3_decisions"] = sum(
            decisions is not None and decisions <= 3 for decisions in each("decisions_to_two_levels")
        )
        entry["three_levels_beyond_1_5_m"] = sum(
            share is not None and share > 0.9 for share in each("share_three_levels_beyond_1_5_m")
        )
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
