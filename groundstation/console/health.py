"""Is the estimator honest? Normalised innovations over a window, per edge, against their 95 % bounds."""

import math
from collections import deque
from dataclasses import dataclass, field
from typing import Any

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


@dataclass(slots=True)
class _Edge:
    nis: deque[tuple[float, int]] = field(default_factory=lambda: deque(maxlen=_WINDOW))
    verdicts: deque[Verdict] = field(default_factory=lambda: deque(maxlen=_WINDOW))
    last: str = ""


class Health:
    """Collects innovations per (observer, subject)."""

    def __init__(self) -> None:
        self._edges: dict[tuple[str, str], _Edge] = {}

    def take(self, innovation: Innovation) -> None:
        """Take one in; only what entered the filter counts towards the NIS."""
        edge = self._edges.setdefault((innovation.observer, innovation.subject), _Edge())
        edge.verdicts.append(innovation.verdict)
        if innovation.verdict not in _COUNTED:
            edge.last = f"{innovation.verdict} {innovation.reason}".strip()
        elif innovation.nis is not None and innovation.residual:
            edge.nis.append((innovation.nis, len(innovation.residual)))

    def nis(self) -> float | None:
        """Return the mean NIS per degree of freedom over all edges; None while there are too few."""
        figure: float | None = _figures(list(self._edges.values()))["nis"]
        return figure

    def summary(self) -> dict[str, Any]:
        """Return the mean NIS per degree of freedom with its bounds, over all edges and for each."""
        edges = [
            {"observer": observer, "subject": subject, "refused": edge.last, **_figures([edge])}
            for (observer, subject), edge in sorted(self._edges.items())
        ]
        return {**_figures(list(self._edges.values())), "edges": edges}


def _figures(edges: list[_Edge]) -> dict[str, Any]:
    values = [value for edge in edges for value in edge.nis]
    verdicts = [verdict for edge in edges for verdict in edge.verdicts]
    degrees = sum(size for _, size in values)
    accepted = sum(verdict in _COUNTED for verdict in verdicts) / len(verdicts) if verdicts else None
    if len(values) < _FEWEST:
        return {"nis": None, "low": None, "high": None, "accepted": accepted}
    low, high = chi_square_bounds(degrees)
    mean = sum(nis for nis, _ in values) / degrees
    return {
        "nis": round(mean, 3),
        "low": round(low / degrees, 3),
        "high": round(high / degrees, 3),
        "accepted": None if accepted is None else round(accepted, 3),
    }
