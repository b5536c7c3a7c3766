"""Summarises several flights: means over flights with confidence intervals, since errors within a flight correlate."""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from groundstation.estimation.mean_interval import half_width
from groundstation.field.resolved import ResolvedField


@dataclass(frozen=True, slots=True)
class Interval:
    """Mean over flights and the half width of its two-sided 95 % interval (NaN for a single flight)."""

    mean: float
    half: float
    flights: int

    def __str__(self) -> str:
        return f"{self.mean:.3f} +- {self.half:.3f}"


def interval(values: Iterable[float]) -> Interval:
    """Return the mean of one value per flight, with Student's factor for so many flights."""
    found = [value for value in values if math.isfinite(value)]
    return Interval(float(np.mean(found)) if found else math.nan, half_width(found), len(found))


def anees(report: Mapping[str, Any], names: Iterable[str], suffix: str = "") -> float:
    """Return a flight's mean NEES per degree of freedom over all entities ever in the belief; NaN for none."""
    found = [report["anees"][name + suffix] for name in names if name + suffix in report["anees"]]
    return float(np.mean(found)) if found else math.nan


def nis(report: Mapping[str, Any], observers: Iterable[str]) -> float:
    """Return a flight's mean NIS per degree of freedom over these observers' sightings; NaN without any."""
    among = frozenset(observers)
    found = [value for edge, value in report["nis"].items() if edge.split(">")[0] in among]
    return float(np.mean(found)) if found else math.nan


def summary(reports: Sequence[Mapping[str, Any]], field: ResolvedField) -> dict[str, Interval]:
    """Return figures of the belief's accuracy and consistency, over the flights of one field."""
    robots, targets, cameras = tuple(field.drones), tuple(field.tracked), tuple(field.cameras)
    values = {
        "target_rmse_m": [report["target_rmse_m"] for report in reports],
        "target_lost_s": [report["target_lost_s"] for report in reports],
        "robot_max_m": [max(report["robot_max_m"].values(), default=math.nan) for report in reports],
        "anees robots": [anees(report, robots) for report in reports],
        "anees robots xy": [anees(report, robots, " xy") for report in reports],
        "anees target": [anees(report, targets) for report in reports],
        "anees target xy": [anees(report, targets, " xy") for report in reports],
        "nis fixed cameras": [nis(report, cameras) for report in reports],
        "nis onboard cameras": [nis(report, robots) for report in reports],
    }
    return {name: interval(found) for name, found in values.items()}
