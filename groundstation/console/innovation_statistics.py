"""The estimator's consistency: normalised innovations over a window, per edge, against their 95 % bounds."""

import math
from collections import deque
from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Any, NamedTuple

from groundstation.bus.messages import Innovation, Verdict

_WINDOW = 60
_FEWEST = 8
_COUNTED = frozenset({Verdict.ACCEPTED, Verdict.INFLATED})
_Z_95 = 1.959964


def chi_square_bounds(degrees: int) -> tuple[float, float]:
    """Return the two-sided 95 % bounds of a chi-square variable, by Wilson and Hilferty (1931); good to 5 % from 5."""
    spread = 2.0 / (9.0 * degrees)
    low, high = (degrees * (1.0 - spread + sign * _Z_95 * math.sqrt(spread)) ** 3 for sign in (-1.0, 1.0))
    return max(0.0, low), high


class _Sums(NamedTuple):
    """Over a window: how many NIS values, their sum, their degrees of freedom; how many verdicts, how many accepted."""

    values: int = 0
    nis: float = 0.0
    degrees: int = 0
    verdicts: int = 0
    accepted: int = 0


@dataclass(slots=True)
class _Edge:
    nis: deque[tuple[float, int]] = field(default_factory=lambda: deque(maxlen=_WINDOW))
    verdicts: deque[Verdict] = field(default_factory=lambda: deque(maxlen=_WINDOW))
    last: str = ""

    def sums(self) -> _Sums:
        accepted = sum(map(_COUNTED.__contains__, self.verdicts))
        nis, degrees = map(sum, zip(*self.nis, strict=True)) if self.nis else (0.0, 0)
        return _Sums(len(self.nis), nis, int(degrees), len(self.verdicts), accepted)


class InnovationStatistics:
    """Collects innovations per (observer, subject)."""

    def __init__(self) -> None:
        self._edges: dict[tuple[str, str], _Edge] = {}

    def take(self, innovation: Innovation) -> None:
        """Take an innovation; only fused ones count towards the NIS."""
        edge = self._edges.setdefault((innovation.observer, innovation.subject), _Edge())
        edge.verdicts.append(innovation.verdict)
        if innovation.verdict not in _COUNTED:
            edge.last = f"{innovation.verdict} {innovation.reason}".strip()
        elif innovation.nis is not None and innovation.residual:
            edge.nis.append((innovation.nis, len(innovation.residual)))

    def nis(self) -> float | None:
        """Return the mean NIS per degree of freedom over all edges; None while there are too few."""
        figure: float | None = _figures(_total(edge.sums() for edge in self._edges.values()))["nis"]
        return figure

    def summary(self) -> dict[str, Any]:
        """Return the mean NIS per degree of freedom with its bounds, over all edges and for each."""
        sums = {names: edge.sums() for names, edge in sorted(self._edges.items())}
        edges = [
            {"observer": observer, "subject": subject, "refused": self._edges[observer, subject].last, **_figures(own)}
            for (observer, subject), own in sums.items()
        ]
        return {**_figures(_total(sums.values())), "edges": edges}


def _total(sums: Iterable[_Sums]) -> _Sums:
    return _Sums(*map(sum, zip(_Sums(), *sums, strict=True)))


def _figures(sums: _Sums) -> dict[str, Any]:
    accepted = sums.accepted / sums.verdicts if sums.verdicts else None
    if sums.values < _FEWEST:
        return {"nis": None, "low": None, "high": None, "accepted": accepted}
    low, high = chi_square_bounds(sums.degrees)
    return {
        "nis": round(sums.nis / sums.degrees, 3),
        "low": round(low / sums.degrees, 3),
        "high": round(high / sums.degrees, 3),
        "accepted": None if accepted is None else round(accepted, 3),
    }
