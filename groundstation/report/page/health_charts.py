"""Charts of the system's health: NIS, NEES, latency, telemetry, processor."""

from itertools import cycle

import numpy as np

from groundstation.appearance.colours import NEUTRAL_COLOUR
from groundstation.arrays import Array
from groundstation.bus.messages import VehicleStatus
from groundstation.report.consistency import bounds, nees_per_dof, windowed_nis
from groundstation.report.page.chart import Chart, Curve, chart_times, held, points, times, with_data
from groundstation.report.plot_style import MUTED_CURVE, SERIES_COLORS, color_of
from groundstation.report.tracks import RunData

_STATUS_HOLDS_S = 1.5
_LATENCY_PERCENTILE = 95
_PROCESSES_SHOWN = 6


def health_charts(data: RunData, start_s: float, end_s: float) -> list[Chart]:
    """Return the charts that the recording has data for."""
    grid, span = chart_times(start_s, end_s), (start_s, end_s)
    vehicles = _vehicles(data, grid)
    return with_data((_nis(data, *span), _nees(data, grid), _latency(data, *span), *vehicles, _processor(data, grid)))


def _nis(data: RunData, start_s: float, end_s: float) -> Chart:
    middles, nis, low, high = windowed_nis(data.innovations, start_s, end_s)
    curves = [
        Curve("all observations", NEUTRAL_COLOUR, points(nis)),
        Curve("95 % bounds", MUTED_CURVE, points(low), dashed=True),
        Curve("", MUTED_CURVE, points(high), dashed=True),
    ]
    note = "per degree of freedom in windows of 1 s; 1 is consistent, above the bounds the filter is overconfident"
    return Chart("NIS", "", note, times(middles), curves)


def _nees(data: RunData, grid: Array) -> Chart:
    curves = []
    for name in (*data.tracked, *data.drones):
        truth, estimate = data.truth.get(name), data.estimates.get(name)
        if truth is not None and estimate is not None and len(estimate.time_s):
            values = nees_per_dof(grid, truth, estimate)
            if name in data.drones:
                values[~truth.airborne_at(grid)] = np.nan
            curves.append(Curve(name, color_of(name, data), points(np.maximum(values, 1e-3))))
    low, high = bounds(4)
    limits = [Curve(f"{text} bound of one robot", MUTED_CURVE, [value] * len(grid), dashed=True)
              for text, value in ((f"95 % {low:.2f}", low), (f"{high:.2f}", high))]  # fmt: skip
    note = "error against the truth in units of the estimated covariance, per degree of freedom; 1 is consistent"
    return Chart("NEES", "", note, times(grid), curves and [*curves, *limits], log=True)


def _latency(data: RunData, start_s: float, end_s: float) -> Chart:
    edges = np.arange(start_s, end_s + 1.0, 1.0)
    middles = edges[:-1] + 0.5
    curves = []
    observers = sorted({item.message.observer for item in data.innovations})
    fixed = cycle((NEUTRAL_COLOUR, MUTED_CURVE))
    for observer in observers:
        color = color_of(observer, data) if observer in data.drones else next(fixed)
        own = [(item.time_s, item.message.latency_ms) for item in data.innovations if item.message.observer == observer]
        table = np.array(own)
        window = np.searchsorted(edges, table[:, 0], side="right") - 1
        values = [
            float(np.percentile(table[window == k, 1], _LATENCY_PERCENTILE)) if (window == k).any() else np.nan
            for k in range(len(middles))
        ]
        curves.append(Curve(f"seen by {observer}", color, points(values, 1)))
    note = f"from exposure to the filter, {_LATENCY_PERCENTILE}th percentile of each second"
    return Chart("Latency of observations", "ms", note, times(middles), curves)


def _vehicles(data: RunData, grid: Array) -> list[Chart]:
    def chart(title: str, unit: str, note: str, value: str) -> Chart:
        curves = []
        for name, statuses in sorted(data.vehicles.items()):
            known = [
                (item.time_s, _number(item.message, value)) for item in sorted(statuses, key=lambda item: item.time_s)
            ]
            own = held(grid, [time_s for time_s, _ in known], [number for _, number in known], _STATUS_HOLDS_S)
            curves.append(Curve(name, color_of(name, data), points(own)))
        return Chart(title, unit, note, times(grid), curves)

    return [
        chart("Telemetry rate", "Hz", "as the driver counted it", "rate_hz"),
        chart("Battery", "", "0 to 1, as the vehicle reports it", "battery"),
        chart("Link quality", "", "0 to 1, where the vehicle reports it", "link_quality"),
    ]


def _number(status: VehicleStatus, value: str) -> float:
    number = getattr(status, value)
    return np.nan if number is None else float(number)


def _processor(data: RunData, grid: Array) -> Chart:
    busiest = sorted(data.processes.items(), key=lambda item: -float(item[1].cpu.mean()))[:_PROCESSES_SHOWN]
    curves = [
        Curve(name, color, points(held(grid, track.time_s.tolist(), track.cpu.tolist(), 2.5)))
        for color, (name, track) in zip(SERIES_COLORS, busiest, strict=False)
    ]
    return Chart("Processor", "cores", f"the {_PROCESSES_SHOWN} busiest processes", times(grid), curves)
