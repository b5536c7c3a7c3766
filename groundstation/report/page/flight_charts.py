"""Charts of the flight: errors against the truth with the filter's deviations, topology, heights, speeds."""

import numpy as np

from groundstation.appearance.colours import NEUTRAL_COLOUR
from groundstation.appearance.cost import COST_UNIT, cost_cm2
from groundstation.appearance.topology import topology_words
from groundstation.arrays import Array
from groundstation.geometry.ellipse import semi_axes_95
from groundstation.report.accuracy import STALE_S, errors_at
from groundstation.report.page.chart import Chart, Curve, Span, chart_times, held, points, times, with_data
from groundstation.report.plot_style import KIND_COLORS, MUTED_CURVE, color_of
from groundstation.report.topology_use import kind_of, merged, segments
from groundstation.report.tracks import EstimateTrack, RunData

_PLAN_HOLDS_S = 0.5


def flight_charts(data: RunData, start_s: float, end_s: float) -> list[Chart]:
    """Return the charts that the recording has data for."""
    grid = chart_times(start_s, end_s)
    return with_data(make(data, grid) for make in (_errors, _beliefs, _cost, _heights, _speeds))


def _spans(data: RunData, grid: Array) -> list[Span]:
    parts = merged(segments(data, float(grid[0]), float(grid[-1])))
    return [
        Span(round(begin, 2), round(end, 2), KIND_COLORS[kind_of(text)], topology_words(text))
        for begin, end, text in parts
    ]


def _names(data: RunData) -> tuple[str, ...]:
    return (*data.tracked, *data.drones)


def _errors(data: RunData, grid: Array) -> Chart:
    curves = []
    for name in _names(data):
        truth = data.truth.get(name)
        if truth is not None:
            size = 2 if name in data.tracked else 3
            distance = np.linalg.norm(errors_at(grid, truth, data.estimates.get(name), size), axis=1)
            if size == 3:
                distance[~truth.airborne_at(grid)] = np.nan
            curves.append(Curve(name, color_of(name, data), points(distance)))
    note = "distance between estimate and truth; a gap: no estimate younger than 0.5 s, or no truth"
    return Chart("Position error", "m", note, times(grid), curves, _spans(data, grid))


def _beliefs(data: RunData, grid: Array) -> Chart:
    curves = [
        Curve(name, color_of(name, data), points(semi_axis_m(data.estimates[name], grid)))
        for name in _names(data)
        if name in data.estimates
    ]
    note = "larger semi-axis of the 95 % ellipse in the plane: the error that the filter expected"
    return Chart("Estimated uncertainty", "m", note, times(grid), curves)


def semi_axis_m(estimate: EstimateTrack, grid: Array) -> Array:
    """Return the larger semi-axis [m] of the 95 % ellipse in the plane at each time; NaN without an estimate."""
    result = np.full(len(grid), np.nan)
    for row, index in enumerate(estimate.latest_at(grid, STALE_S)):
        if index >= 0:
            result[row] = semi_axes_95(*estimate.covariance[index, [0, 0, 1], [0, 1, 1]].tolist())[0]
    return result


def _cost(data: RunData, grid: Array) -> Chart:
    own = [plan.time_s for plan in data.plans]
    chosen = [cost_cm2(plan.message.cost) for plan in data.plans]
    others = [
        min(
            (cost_cm2(other.cost) for other in plan.message.alternatives if other.topology != plan.message.topology),
            default=np.nan,
        )
        for plan in data.plans
    ]
    curves = [
        Curve("chosen topology", NEUTRAL_COLOUR, points(held(grid, own, chosen, _PLAN_HOLDS_S), 2)),
        Curve(
            "best alternative (or its bound)",
            MUTED_CURVE,
            points(held(grid, own, others, _PLAN_HOLDS_S), 2),
            dashed=True,
        ),
    ]
    note = "expected uncertainty over the horizon, as the planner weighed it"
    return Chart("Plan cost", COST_UNIT, note, times(grid), curves, _spans(data, grid))


def _heights(data: RunData, grid: Array) -> Chart:
    curves = []
    for name in data.drones:
        color = color_of(name, data)
        if name in data.truth:
            curves.append(Curve(f"{name} true", color, points(data.truth[name].position_at(grid)[:, 2])))
        estimate = data.estimates.get(name)
        if estimate is not None and estimate.mean.shape[1] > 2:
            heights = held(grid, estimate.time_s.tolist(), estimate.mean[:, 2].tolist(), STALE_S)
            curves.append(Curve(f"{name} estimated", color, points(heights), dashed=True))
    return Chart("Height", "m", "above the floor", times(grid), curves)


def _speeds(data: RunData, grid: Array) -> Chart:
    curves = []
    for name in data.drones:
        own, given, wanted = [], [], []
        for plan in data.plans:
            for control in plan.message.controls:
                if control.robot == name:
                    own.append(plan.time_s)
                    given.append(float(np.linalg.norm(control.velocity_m_s)))
                    wanted.append(float(np.linalg.norm(control.wanted_m_s or control.velocity_m_s)))
        color = color_of(name, data)
        curves.append(Curve(f"{name} commanded", color, points(held(grid, own, given, _PLAN_HOLDS_S))))
        curves.append(Curve(f"{name} wanted", color, points(held(grid, own, wanted, _PLAN_HOLDS_S)), dashed=True))
    return Chart("Commanded speed", "m/s", "dashed: before safety limited it", times(grid), curves)
