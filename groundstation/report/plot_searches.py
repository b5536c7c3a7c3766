"""Maps of searches: probable places of the target, its true place, and the places of the drones."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import LinearSegmentedColormap
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from groundstation.bus.messages import SearchMap
from groundstation.report.accuracy import STALE_S
from groundstation.report.plot_style import INK, MUTED, color_of
from groundstation.report.searches import Search
from groundstation.report.tracks import RunData, TimedMessage

_COLUMNS = 3
_HEADING_M = 0.5


def draw_searches(data: RunData, found: list[Search]) -> Figure:
    """Return one row of maps per search, its begin on the left."""
    figure = Figure(figsize=(11.4, 0.4 + 2.9 * len(found)), layout="constrained")
    grid = figure.subplots(len(found), _COLUMNS, squeeze=False)
    for row, search in zip(grid, found, strict=True):
        for axes, one in zip(row, search.maps, strict=False):
            _draw(axes, data, search, one)
        for axes in row[len(search.maps) :]:
            axes.set_axis_off()
    return figure


def _draw(axes: Axes, data: RunData, search: Search, one: TimedMessage[SearchMap]) -> None:
    since_s = one.time_s - search.begin_s
    axes.set_title(f"{search.target}, {one.time_s:.1f} s" + (f" (+{since_s:.1f} s)" if since_s else ""), fontsize=10)
    _draw_chances(axes, one.message, color_of(search.target, data).light)
    width, depth, _ = data.resolved.room.size_m
    axes.add_patch(Rectangle((-width / 2, -depth / 2), width, depth, fill=False, ec=INK, lw=1.2))
    at = np.array([one.time_s])
    for name in data.drones:
        track = data.estimates.get(name)
        index = -1 if track is None or not len(track.time_s) else int(track.latest_at(at, STALE_S)[0])
        if track is not None and index >= 0:
            x, y, _, yaw = track.mean[index, :4].tolist()
            color = color_of(name, data).light
            axes.plot(x, y, "o", ms=6, color=color)
            ahead = (x + _HEADING_M * np.cos(yaw), y + _HEADING_M * np.sin(yaw))
            axes.plot((x, ahead[0]), (y, ahead[1]), color=color, lw=1.4)
    truth = data.truth.get(search.target)
    if truth is not None:
        where = truth.position_m[max(0, int(np.searchsorted(truth.time_s, one.time_s, side="right")) - 1)]
        axes.plot(*where[:2], "x", ms=8, mew=2.0, color=INK)
    axes.set_xlim(-width / 2 - 0.1, width / 2 + 0.1)
    axes.set_ylim(-depth / 2 - 0.1, depth / 2 + 0.1)
    axes.set_aspect("equal")
    axes.tick_params(labelsize=8, color=MUTED)


def _draw_chances(axes: Axes, message: SearchMap, color: str) -> None:
    """Draw the cells, the likeliest one in the target's colour."""
    cells = np.array(message.chances, dtype=np.float64).reshape(-1, message.columns)
    rows, columns = cells.shape
    left, low = (middle - message.cell_m / 2 for middle in message.first_m)
    extent = (left, left + columns * message.cell_m, low, low + rows * message.cell_m)
    shades = LinearSegmentedColormap.from_list("chance", ["white", color])
    axes.imshow(cells, origin="lower", extent=extent, cmap=shades, vmin=0, vmax=255, interpolation="nearest", zorder=0)
