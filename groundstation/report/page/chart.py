"""Charts over time as values, without their drawing."""

from collections.abc import Iterable, Sequence

import msgspec
import numpy as np

from groundstation.appearance.colours import Colour
from groundstation.arrays import Array
from groundstation.report.accuracy import time_grid

_MOST_POINTS = 3000


class Curve(msgspec.Struct, frozen=True):
    """One line of a chart; `values` has None where nothing is drawn."""

    label: str
    color: Colour
    values: list[float | None]
    dashed: bool = False


class Span(msgspec.Struct, frozen=True):
    """A coloured stretch of time behind the curves, or a mark if both ends are the same."""

    begin_s: float
    end_s: float
    color: str
    label: str


class Chart(msgspec.Struct, frozen=True):
    """Curves over one time axis [s]; `log` draws the values on a logarithmic axis.

    axis: unit of the horizontal axis; "" for numbers of runs, whose values are drawn as points.
    """

    title: str
    unit: str
    note: str
    time_s: list[float]
    curves: list[Curve]
    spans: list[Span] = []
    log: bool = False
    axis: str = "s"


def chart_times(start_s: float, end_s: float) -> Array:
    """Return the times of a chart's points: a few thousand at most, evenly spaced."""
    grid = time_grid(start_s, end_s)
    return grid[:: max(1, -(-len(grid) // _MOST_POINTS))]


def with_data(charts: Iterable[Chart]) -> list[Chart]:
    """Return the charts that have a point."""
    return [chart for chart in charts if any(value is not None for curve in chart.curves for value in curve.values)]


def points(values: Array | Sequence[float], digits: int = 4) -> list[float | None]:
    """Return values rounded for the page; values that are not finite become None."""
    return [round(float(value), digits) if np.isfinite(value) else None for value in values]


def times(values: Array) -> list[float]:
    """Return times rounded to milliseconds."""
    return [round(float(value), 3) for value in values]


def held(time_s: Array, own_s: Sequence[float], values: Sequence[float], stale_s: float) -> Array:
    """Return the newest of `values` (of times own_s) at each time; NaN if it is older than stale_s."""
    if not len(own_s):
        return np.full(len(time_s), np.nan)
    own, series = np.asarray(own_s, dtype=np.float64), np.asarray(values, dtype=np.float64)
    index = np.searchsorted(own, time_s, side="right") - 1
    fresh = (index >= 0) & (time_s - own[np.clip(index, 0, None)] <= stale_s)
    return np.where(fresh, series[np.clip(index, 0, None)], np.nan)
