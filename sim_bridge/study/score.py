"""Judges a run: the figures of report.json, and the consistency of the belief."""

import math
from collections import defaultdict
from collections.abc import Collection
from dataclasses import dataclass, field
from itertools import combinations
from typing import Any

import numpy as np

from groundstation.arrays import Array
from groundstation.bus.messages import Verdict
from groundstation.estimation.belief import JointBelief
from groundstation.estimation.chi_square import gate
from groundstation.estimation.layout import EntityKind
from groundstation.estimation.measurement import Correction

_MISSING_M, _LOST_M = 1.0, 0.5
_USED = (Verdict.ACCEPTED, Verdict.INFLATED)
_DIVERGED = 33.4  # chi-square of 4 degrees of freedom, probability 1e-6


@dataclass
class FlightScore:
    """Collects errors at 10 Hz and corrections as they come; `report` turns them into figures."""

    period_s: float
    gate_probability: float = 0.997
    errors: defaultdict[str, list[float]] = field(default_factory=lambda: defaultdict(list))
    nees: defaultdict[str, list[float]] = field(default_factory=lambda: defaultdict(list))
    squares: defaultdict[str, list[float]] = field(default_factory=lambda: defaultdict(list))
    nis: defaultdict[str, list[float]] = field(default_factory=lambda: defaultdict(list))
    verdicts: defaultdict[str, int] = field(default_factory=lambda: defaultdict(int))
    topologies: defaultdict[str, float] = field(default_factory=lambda: defaultdict(float))
    diverged_s: defaultdict[str, float] = field(default_factory=lambda: defaultdict(float))
    switches: int = 0
    separation_m: float = math.inf
    unseen_s: float = 0.0
    _last: str = ""

    def __post_init__(self) -> None:
        self.gates = {rows: gate(self.gate_probability, rows) for rows in range(1, 5)}

    def take(
        self,
        belief: JointBelief,
        truth: dict[str, Array],
        targets: Collection[str],
        topology: str,
        ages_s: dict[str, float],
    ) -> None:
        """Compare a belief with the truth (rows of the truth board) at one time; ages_s: since each robot was seen."""
        self.unseen_s = max(self.unseen_s, *ages_s.values(), 0.0)
        for block in belief.layout.blocks:
            if block.kind not in (EntityKind.ROBOT, EntityKind.TARGET):
                continue
            state, part = truth[block.name], belief.mean_of(block.name)
            covariance = belief.covariance_of(block.name)
            true = state[[0, 1, 2, 8]] if block.kind is EntityKind.ROBOT else state[[0, 1, 3, 4]]
            error = true - part[:4]
            if block.kind is EntityKind.ROBOT:
                error[3] = math.remainder(error[3], math.tau)
            self._judge(block.name, block.labels, error, covariance[:4, :4])
        for target in targets:
            known = target in belief.layout
            self.errors[target].append(math.sqrt(self.squares[target][-1]) if known else _MISSING_M)
        self.topologies[topology] += self.period_s
        self.switches += bool(self._last) and topology != self._last
        self._last = topology
        drones = [row[:3] for name, row in truth.items() if name not in targets]
        for a, b in combinations(drones, 2):
            self.separation_m = min(self.separation_m, float(np.linalg.norm(a - b)))

    def _judge(self, name: str, labels: tuple[str, ...], error: Array, covariance: Array) -> None:
        """Take one entity's error; beyond the NEES that a right covariance exceeds once in 1e6, it has diverged."""
        nees = float(error @ np.linalg.solve(covariance, error))
        self.nees[name].append(nees / 4)
        self.nees[f"{name} xy"].append(float(error[:2] @ np.linalg.solve(covariance[:2, :2], error[:2])) / 2)
        for label, e, variance in zip(labels[2:], error[2:], np.diag(covariance)[2:], strict=False):
            self.nees[f"{name} {label}"].append(float(e * e / variance))
        self.squares[name].append(float(error[:2] @ error[:2]))
        self.diverged_s[name] += self.period_s * (nees > _DIVERGED)

    def note(self, correction: Correction) -> None:
        """Count an observation by its verdict, with the NIS of one that was used."""
        self.verdicts[str(correction.verdict)] += 1
        if correction.nis is not None and not correction.joined and correction.verdict in _USED:
            edge = f"{correction.observer}>{correction.subject}"
            rows = len(correction.residual)
            self.nis[edge].append(min(correction.nis, self.gates[rows]) / rows)

    def report(self) -> dict[str, Any]:
        """Return all figures, rounded for reading; those of the target are those of the worst."""
        targets = {name: _figures(np.array(errors), self.period_s) for name, errors in self.errors.items()}
        never = _figures(np.array([_MISSING_M]), self.period_s)
        worst = {key: max((one[key] for one in targets.values()), default=never[key]) for key in never}
        flat = sum(s for t, s in self.topologies.items() if t and "/" not in t)
        string = sum(s for t, s in self.topologies.items() if "/" in t)
        return {
            **{f"target_{key}": value for key, value in worst.items()},
            **({"targets": targets} if len(targets) > 1 else {}),
            "robot_rmse_m": {k: round(math.sqrt(float(np.mean(v))), 4) for k, v in self.squares.items()},
            "robot_max_m": {k: round(math.sqrt(max(v)), 3) for k, v in self.squares.items() if k not in self.errors},
            "topology_seconds": {"flat": round(flat, 1), "string": round(string, 1)},
            "topology_switches": self.switches,
            "longest_unseen_s": _finite(self.unseen_s, 1),
            "min_separation_m": _finite(self.separation_m, 3),
            "anees": {k: round(float(np.mean(v)), 3) for k, v in self.nees.items()},
            "diverged_s": {k: round(v, 1) for k, v in self.diverged_s.items()},
            "nis": {k: round(float(np.mean(v)), 3) for k, v in sorted(self.nis.items())},
            "verdicts": dict(sorted(self.verdicts.items())),
        }


def _finite(value: float, digits: int) -> float | None:
    """Return a rounded figure, None for one without bound, which JSON cannot hold: one drone, or one never seen."""
    return round(value, digits) if math.isfinite(value) else None


def _figures(errors: Array, period_s: float) -> dict[str, float]:
    """Return the figures of a target's errors; a missing estimate counts as 1 m."""
    return {
        "rmse_m": round(float(np.sqrt(np.mean(errors**2))), 4),
        "lost_s": round(float(np.sum(errors > _LOST_M)) * period_s, 2),
        "max_m": round(float(errors.max()), 3),
    }
