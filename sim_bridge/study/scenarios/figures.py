"""Figures of a flight of a scenario, compared with the expectations of its file."""

import math
from collections import defaultdict
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from groundstation.arrays import Array
from groundstation.estimation.tracking_errors import tracking_figures
from sim_bridge.surroundings import ScenarioExpectation

SEPARATION_M = 0.6


@dataclass(slots=True)
class TrackingErrors:
    """Errors of all targets at an even rate while the team tracks; inf for an unknown place."""

    period_s: float
    errors: defaultdict[str, list[float]] = field(default_factory=lambda: defaultdict(list))

    def take(self, truth: Mapping[str, Array], believed: Mapping[str, Array | None]) -> None:
        """Record one moment: rows of the truth board, and the estimated place of each target."""
        for name, place in believed.items():
            off = math.inf if place is None else float(np.hypot(*(place[:2] - truth[name][:2])))
            self.errors[name].append(off)

    def figures(self) -> dict[str, Any]:
        """Return each figure of the target that has the worst: time until found, errors [m], losses [s].

        None: a target was never found.
        """
        found = [self._of(np.array(errors)) for errors in self.errors.values()]
        values = {key: [one[key] for one in found] for key in found[0]}
        return {key: None if None in each else max(each) for key, each in values.items()}

    def _of(self, errors: Array) -> dict[str, Any]:
        found = tracking_figures(errors, self.period_s)
        if found is None:
            return {"found_s": None, "rmse_m": None, "worst_m": None, "lost_s": None, "longest_loss_s": None}
        return {
            "found_s": round(found.found_s, 2),
            "rmse_m": round(found.rmse_m, 4),
            "worst_m": round(found.worst_m, 3),
            "lost_s": round(found.lost_s, 2),
            "longest_loss_s": round(found.longest_loss_s, 2),
        }


def shortfalls(figures: Mapping[str, Any], expected: ScenarioExpectation) -> list[str]:
    """Return the expectations of its scenario that a flight did not meet; empty if all are met."""
    missed = []
    for key in ("found_s", "rmse_m", "lost_s"):
        limit, value = getattr(expected, key), figures[key]
        if limit is not None and (value is None or value > limit):
            missed.append(f"{key} {'never' if value is None else value} > {limit:g}")
    if figures["landings"] > expected.landings:
        missed.append(f"landings {figures['landings']} > {expected.landings}")
    missed += [f"{what}" for what in figures["violations"]]
    return missed
