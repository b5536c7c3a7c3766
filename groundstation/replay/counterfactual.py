"""What would have been believed and planned with other settings, beside what was; the truth is for judging only.

The vehicles flew as they flew: a plan that is other than the recorded one moved nobody.
"""

from dataclasses import asdict, dataclass, field
from typing import Any

import numpy as np

from groundstation.report.accuracy import time_grid
from groundstation.report.metrics import Figures, figures_of
from groundstation.report.topology_use import segments
from groundstation.report.tracks import RunData

_STALE_S = 0.5
_LISTED = 20
_RATE = ("target_rmse_m", "target_lost_s", "topology_switches", "tracked_s")


@dataclass(frozen=True, slots=True)
class Row:
    """One figure of both; None where there is nothing to measure."""

    name: str
    recorded: float | None
    now: float | None

    @property
    def changed(self) -> bool:
        """Whether the two differ at all."""
        return self.recorded != self.now


@dataclass(slots=True)
class Changes:
    """Where two runs part: the greatest distance between the estimates of each entity, and other topologies.

    topologies: (from [s], to [s], recorded, now) of each stretch on which the chosen topologies differ.
    """

    farthest: dict[str, dict[str, float]] = field(default_factory=dict)
    topologies: list[tuple[float, float, str, str]] = field(default_factory=list)
    topology_other_s: float = 0.0


def rows_of(recorded: RunData, now: RunData) -> list[Row]:
    """Return all figures of two runs beside each other."""
    before, after = _figures(figures_of(recorded)), _figures(figures_of(now))
    names = [*before, *(name for name in after if name not in before)]
    return [Row(name, before.get(name), after.get(name)) for name in names]


def _figures(figures: Figures) -> dict[str, float | None]:
    rows: dict[str, float | None] = {name: getattr(figures, name) for name in _RATE}
    accuracies = {**({"target": figures.target} if figures.target else {}), **figures.robots}
    for name, accuracy in accuracies.items():
        rows[f"{name} rmse [m]"] = accuracy.rmse_m
        rows[f"{name} greatest error [m]"] = accuracy.max_error_m
        rows[f"{name} anees (1 is honest)"] = accuracy.anees
    rows |= {f"nis {edge} (1 is honest)": value for edge, value in figures.mean_nis.items()}
    rows |= {f"observations {verdict}": float(count) for verdict, count in sorted(figures.verdicts.items())}
    rows |= {f"topology {name} [s]": value for name, value in sorted(figures.topology_seconds.items())}
    return rows


def changes_of(recorded: RunData, now: RunData) -> Changes:
    """Return where the two part."""
    changes = Changes()
    for name in sorted(set(recorded.estimates) & set(now.estimates)):
        before, after = recorded.estimates[name], now.estimates[name]
        grid = time_grid(float(before.time_s[0]), float(before.time_s[-1]))
        first, second = before.latest_at(grid, _STALE_S), after.latest_at(grid, _STALE_S)
        known = (first >= 0) & (second >= 0)
        if not known.any():
            continue
        apart = np.linalg.norm(before.mean[first[known], :2] - after.mean[second[known], :2], axis=1)
        changes.farthest[name] = {"m": float(apart.max()), "at_s": float(grid[known][apart.argmax()])}
    _compare_topologies(recorded, now, changes)
    return changes


def _compare_topologies(recorded: RunData, now: RunData, changes: Changes) -> None:
    end = max(recorded.end_s, now.end_s)
    mine = segments(now, 0.0, end)
    for begin, finish, text in segments(recorded, 0.0, end):
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
    figures = {row.name: {"recorded": row.recorded, "now": row.now} for row in rows}
    return {"figures": figures, "changes": asdict(changes)}
