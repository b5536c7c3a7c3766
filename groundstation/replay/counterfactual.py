"""Compares belief and plans under other settings with the recorded ones; the truth is for judging only.

The vehicles flew as recorded: a plan that differs from the recorded one moved no vehicle.
"""

from dataclasses import asdict, dataclass, field
from typing import Any

import numpy as np

from groundstation.report.accuracy import time_grid
from groundstation.report.metrics import RunFigures, figures_of
from groundstation.report.topology_use import segments
from groundstation.report.tracks import RunData
from groundstation.report.wording import title

_STALE_S = 0.5
_LISTED = 20
_OVERALL = {"tracked_s": "tracked [s]", "target_lost_s": "target lost [s]", "topology_switches": "topology switches"}


@dataclass(frozen=True, slots=True)
class Row:
    """One figure before and after a change; None if it cannot be measured."""

    name: str
    before: float | None
    after: float | None


@dataclass(slots=True)
class Changes:
    """The differences of two runs: the greatest distance between the estimates of each entity, and other topologies.

    topologies: (from [s], to [s], before, after) of each stretch on which the chosen topologies differ.
    """

    farthest: dict[str, dict[str, float]] = field(default_factory=dict)
    topologies: list[tuple[float, float, str, str]] = field(default_factory=list)
    topology_other_s: float = 0.0


def rows_of(before: RunData, after: RunData) -> list[Row]:
    """Return all figures of two runs side by side."""
    first, second = _figures(figures_of(before)), _figures(figures_of(after))
    names = [*first, *(name for name in second if name not in first)]
    return [Row(name, first.get(name), second.get(name)) for name in names]


def _figures(figures: RunFigures) -> dict[str, float | None]:
    rows: dict[str, float | None] = {words: getattr(figures, name) for name, words in _OVERALL.items()}
    single = {"target": figures.target} if figures.target and len(figures.targets) < 2 else figures.targets
    accuracies = {**single, **figures.robots}
    for name, accuracy in accuracies.items():
        rows[f"{name} rmse [m]"] = accuracy.rmse_m
        rows[f"{name} greatest error [m]"] = accuracy.max_error_m
        rows[f"{name} anees (1 is ideal)"] = accuracy.anees
    rows |= {f"nis {edge} (1 is ideal)": value for edge, value in figures.mean_nis.items()}
    rows |= {f"observations {verdict}": float(count) for verdict, count in sorted(figures.verdicts.items())}
    rows |= {
        f"{title(f'topology_seconds.{name}')} [s]": value for name, value in sorted(figures.topology_seconds.items())
    }
    return rows


def changes_of(before: RunData, after: RunData) -> Changes:
    """Return the differences of two runs."""
    changes = Changes()
    for name in sorted(set(before.estimates) & set(after.estimates)):
        one, other = before.estimates[name], after.estimates[name]
        grid = time_grid(float(one.time_s[0]), float(one.time_s[-1]))
        first, second = one.latest_at(grid, _STALE_S), other.latest_at(grid, _STALE_S)
        known = (first >= 0) & (second >= 0)
        if not known.any():
            continue
        apart = np.linalg.norm(one.mean[first[known], :2] - other.mean[second[known], :2], axis=1)
        changes.farthest[name] = {"m": float(apart.max()), "at_s": float(grid[known][apart.argmax()])}
    _compare_topologies(before, after, changes)
    return changes


def _compare_topologies(before: RunData, after: RunData, changes: Changes) -> None:
    end = max(before.end_s, after.end_s)
    mine = segments(after, 0.0, end)
    for begin, finish, text in segments(before, 0.0, end):
        for start, stop, other in mine:
            low, high = max(begin, start), min(finish, stop)
            if other == text or high - low < 1e-6:
                continue
            changes.topology_other_s += high - low
            last = changes.topologies[-1] if changes.topologies else None
            if last and last[2:] == (text, other) and low - last[1] < _STALE_S:
                changes.topologies[-1] = (last[0], high, text, other)
            elif len(changes.topologies) < _LISTED:
                changes.topologies.append((low, high, text, other))


def as_json(rows: list[Row], changes: Changes) -> dict[str, Any]:
    """Return both as plain values."""
    figures = {row.name: {"before": row.before, "after": row.after} for row in rows}
    return {"figures": figures, "changes": asdict(changes)}
