"""The recent past for late viewers: trails of all entities and the curves of the charts."""

import math
from collections import deque
from collections.abc import Mapping
from typing import Any

from groundstation.appearance.cost import cost_cm2
from groundstation.appearance.topology import topology_words
from groundstation.bus.messages import Estimate, Plan, TruthState
from groundstation.geometry.ellipse import semi_axes_95
from groundstation.time_units import NS_PER_MS

_TRAIL_POINTS = 300
_TRAIL_NS = 200 * NS_PER_MS
_SAMPLES = 240
_SAMPLE_NS = 500 * NS_PER_MS


class History:
    """One minute of trails at 5 Hz, two minutes of samples at 2 Hz."""

    def __init__(self, targets: tuple[str, ...]) -> None:
        self._targets = targets
        self._trails: dict[str, deque[tuple[float, float]]] = {}
        self._samples: deque[dict[str, Any]] = deque(maxlen=_SAMPLES)
        self._new_points: list[tuple[str, float, float]] = []
        self._new_samples: list[dict[str, Any]] = []
        self._next_trail_ns = self._next_sample_ns = 0

    def due(self, now_ns: int) -> bool:
        """Return whether a sample is due."""
        return now_ns >= self._next_trail_ns or self.sample_due(now_ns)

    def sample_due(self, now_ns: int) -> bool:
        """Return whether a sample of the curves is due."""
        return now_ns >= self._next_sample_ns

    def step(
        self,
        now_ns: int,
        estimate: Estimate | None,
        plan: Plan | None,
        nis: float | None,
        truth: Mapping[str, TruthState],
    ) -> None:
        """Take due samples."""
        if estimate is not None and now_ns >= self._next_trail_ns:
            self._next_trail_ns = now_ns + _TRAIL_NS
            for entity in estimate.entities:
                point = (round(entity.mean[0], 3), round(entity.mean[1], 3))
                self._trails.setdefault(entity.name, deque(maxlen=_TRAIL_POINTS)).append(point)
                self._new_points.append((entity.name, *point))
        if not self.sample_due(now_ns):
            return
        self._next_sample_ns = now_ns + _SAMPLE_NS
        sample = self._sample(now_ns, estimate, plan, nis, truth)
        self._samples.append(sample)
        self._new_samples.append(sample)

    def take_new(self) -> tuple[list[tuple[str, float, float]], list[dict[str, Any]]]:
        """Return the points of trails (name, x, y), and the samples, since the last call: of a fast replay many."""
        new = self._new_points, self._new_samples
        self._new_points, self._new_samples = [], []
        return new

    def as_json(self) -> dict[str, Any]:
        """Return everything kept."""
        return {"trails": {name: list(trail) for name, trail in self._trails.items()}, "samples": list(self._samples)}

    def _sample(
        self,
        now_ns: int,
        estimate: Estimate | None,
        plan: Plan | None,
        nis: float | None,
        truth: Mapping[str, TruthState],
    ) -> dict[str, Any]:
        entities = estimate.entities if estimate is not None else ()
        targets = [entity for entity in entities if entity.name in self._targets]
        axes = [semi_axes_95(t.covariance[0], t.covariance[1], t.covariance[len(t.mean) + 1])[0] for t in targets]
        known = [(target, truth[target.name]) for target in targets if target.name in truth]
        errors = [math.dist(target.mean[:2], there.position_m[:2]) for target, there in known]
        # Of several targets the curves show the worst.
        axis = round(max(axes), 4) if axes else None
        error = round(max(errors), 4) if errors else None
        # A plan without robots has no cost to show in a curve.
        flown = plan if plan is not None and plan.topology else None
        cost = None if flown is None else round(cost_cm2(flown.cost), 2)
        topology = "" if flown is None else topology_words(flown.topology)
        figures = {"axis_m": axis, "error_m": error, "cost_cm2": cost, "nis": nis, "topology": topology}
        return {"t_ms": now_ns / 1e6, **figures}
