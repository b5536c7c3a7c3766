"""trajectories.png: the room from above, and below it curves over time. Imports matplotlib; import it late."""

from pathlib import Path

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from groundstation.appearance.topology import topology_words
from groundstation.arrays import Array, BoolArray
from groundstation.estimation.tracking_errors import LOST_M
from groundstation.report.accuracy import errors_at, time_grid
from groundstation.report.criteria import MAX_TARGET_RMSE_M
from groundstation.report.interval import tracking_interval
from groundstation.report.plot_map import draw_map
from groundstation.report.plot_style import INK, KIND_COLORS, MUTED, STYLE, color_of
from groundstation.report.topology_use import kind_of, merged, segments
from groundstation.report.tracks import RunData
from groundstation.report.wording import KIND_WORDS

_SIZE_IN = (11.4, 13.0)
_DPI = 110
# Share of the axes' width for one letter of a topology.
_LETTER_SHARE = 0.007


def draw(data: RunData, title: str, path: Path) -> None:
    """Write the picture of a run."""
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=_SIZE_IN, layout="constrained")
        rows = figure.add_gridspec(4, 1, height_ratios=(6.4, 1.9, 1.5, 0.8))
        figure.suptitle(title, x=0.012, ha="left", fontsize=14, fontweight="bold", color=INK)
        room = figure.add_subplot(rows[0])
        error, heights, topology = (figure.add_subplot(rows[index]) for index in (1, 2, 3))
        draw_map(room, data)
        _draw_errors(error, data)
        _draw_heights(heights, data)
        _draw_topology(topology, data)
        for axes in (error, heights):
            axes.sharex(topology)
            axes.tick_params(labelbottom=False)
        figure.savefig(path, dpi=_DPI)


def _interval(data: RunData) -> tuple[float, float]:
    return tracking_interval(data) or (0.0, max(data.end_s, 1.0))


def _draw_errors(axes: Axes, data: RunData) -> None:
    grid = time_grid(*_interval(data))
    top = 1.16 * LOST_M
    for name in (*data.drones, *data.tracked):
        truth = data.truth.get(name)
        if truth is None:
            continue
        is_target = name in data.tracked
        errors = errors_at(grid, truth, data.estimates.get(name), 2 if is_target else 3)
        distance = np.linalg.norm(errors, axis=1)
        if not is_target:
            distance[~truth.airborne_at(grid)] = np.nan
        axes.plot(grid, distance, color=color_of(name, data).light, lw=1.8 if is_target else 0.9, zorder=3, label=name)
        if is_target:
            _mark_missing(axes, grid, ~np.isfinite(distance) & truth.known_at(grid))
        if np.isfinite(distance).any():
            top = max(top, min(1.5, 1.1 * float(np.nanmax(distance))))
    for limit, text in ((MAX_TARGET_RMSE_M, "rms limit"), (LOST_M, "lost")):
        axes.axhline(limit, color=MUTED, lw=0.8, ls=(0, (4, 3)), zorder=1)
        axes.annotate(text, (1.0, limit), xycoords=("axes fraction", "data"), xytext=(4, 0),
                      textcoords="offset points", va="center", fontsize=8, color=MUTED)  # fmt: skip
    axes.set_ylim(0, top)
    axes.set_ylabel("position error [m]")
    if axes.get_legend_handles_labels()[0]:
        axes.legend(loc="lower left", bbox_to_anchor=(0, 1.0), ncols=5, borderpad=0.1)


def _mark_missing(axes: Axes, grid: Array, missing: BoolArray) -> None:
    if missing.any():
        axes.fill_between(grid, 0, 1, where=missing, transform=axes.get_xaxis_transform(), color=KIND_COLORS["other"],
                          alpha=0.4, lw=0, label="no estimate of the target")  # fmt: skip


def _draw_heights(axes: Axes, data: RunData) -> None:
    start, end = _interval(data)
    for height in data.heights_m:
        axes.axhline(height, color=MUTED, lw=0.8, ls=(0, (1, 3)), zorder=1)
    for name in data.drones:
        truth, estimate = data.truth.get(name), data.estimates.get(name)
        color = color_of(name, data).light
        if truth is not None:
            for part in truth.stretches(start, end):
                axes.plot(truth.time_s[part], truth.position_m[part, 2], color=color, lw=1.4)
        if estimate is not None and estimate.mean.shape[1] > 2:
            inside = (estimate.time_s >= start) & (estimate.time_s <= end)
            axes.plot(estimate.time_s[inside], estimate.mean[inside, 2], color=color, lw=0.8, alpha=0.45)
    axes.set_ylim(bottom=0)
    axes.set_ylabel("height [m]")


def _draw_topology(axes: Axes, data: RunData) -> None:
    start, end = _interval(data)
    for begin, finish, text in merged(segments(data, start, end)):
        axes.broken_barh([(begin, finish - begin)], (0, 1), facecolors=KIND_COLORS[kind_of(text)], lw=0)
        words = topology_words(text)
        if finish - begin > _LETTER_SHARE * len(words) * (end - start):
            axes.text((begin + finish) / 2, 0.5, words, ha="center", va="center", fontsize=8, color=INK)
    handles = [axes.barh([0], [0], color=color, label=KIND_WORDS[kind]) for kind, color in KIND_COLORS.items()]
    axes.legend(handles=handles, loc="lower left", bbox_to_anchor=(0, 1.0), ncols=3, borderpad=0.1)
    axes.set_xlim(start, end)
    axes.set_ylim(0, 1)
    axes.set_yticks([])
    axes.set_ylabel("topology")
    axes.set_xlabel("time since start of recording [s]")
    axes.grid(visible=False)
