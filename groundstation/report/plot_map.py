"""The room from above, to scale: fence, obstacles, the ceiling camera's view, truth, estimates with 95 % ellipses."""

import math

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.patches import Ellipse, Patch, Rectangle

from groundstation.appearance.colours import FENCE_COLOUR
from groundstation.field.room import WorldCamera
from groundstation.geometry.ellipse import semi_axes_95
from groundstation.report.accuracy import STALE_S
from groundstation.report.interval import tracking_interval
from groundstation.report.plot_style import INK, MUTED, color_of
from groundstation.report.tracks import EstimateTrack, RunData
from groundstation.sensing.from_field import boxes_from_field

_ELLIPSES = 16
_CAMERA = "#6b8e23"


def draw_map(axes: Axes, data: RunData) -> None:
    """Draw the map with its legend."""
    _draw_room(axes, data)
    start, end = tracking_interval(data) or (0.0, max(data.end_s, 1.0))
    for name in (*data.drones, *data.tracked):
        _draw_entity(axes, data, name, start, end)
    width, depth, _ = data.resolved.room.size_m
    axes.set_xlim(-width / 2 - 0.15, width / 2 + 0.15)
    axes.set_ylim(-depth / 2 - 0.15, depth / 2 + 0.15)
    axes.set_aspect("equal")
    axes.set_xlabel("x [m]")
    axes.set_ylabel("y [m]")
    axes.legend(
        handles=_legend(data), loc="upper left", bbox_to_anchor=(1.01, 1.0), borderaxespad=0.0, labelspacing=0.7
    )


def _draw_room(axes: Axes, data: RunData) -> None:
    width, depth, _ = data.resolved.room.size_m
    axes.add_patch(Rectangle((-width / 2, -depth / 2), width, depth, fill=False, ec=INK, lw=1.6, zorder=2))
    (x_low, x_high), (y_low, y_high) = data.resolved.room.fence.x_m, data.resolved.room.fence.y_m
    if x_high - x_low < 1e6:
        fence = Rectangle(
            (x_low, y_low), x_high - x_low, y_high - y_low, fill=False, ec=FENCE_COLOUR.light, lw=1.0, ls="--"
        )
        axes.add_patch(fence)
    for obstacle in boxes_from_field(data.resolved):
        (x_low, x_high), (y_low, y_high) = obstacle.outline.x_m, obstacle.outline.y_m
        axes.add_patch(Rectangle((x_low, y_low), x_high - x_low, y_high - y_low, fc=MUTED, lw=0, zorder=1))
    _draw_views(axes, data)


def _draw_views(axes: Axes, data: RunData) -> None:
    """Draw the views of fixed cameras at each height, and the boxes of motion capture and ranging systems."""
    for camera in data.resolved.cameras.values():
        x, y, _ = camera.position_m
        for index, height in enumerate(data.heights_m):
            half_x, half_y = _footprint_half_m(camera, height)
            _draw_view(axes, (x - half_x, y - half_y), 2 * half_x, 2 * half_y)
            side, ha = (1, "right") if index % 2 == 0 else (-1, "left")  # neighbours do not hide each other
            axes.annotate(f"{height:g} m", (x + side * half_x, y - half_y), xytext=(-3 * side, 3),
                          textcoords="offset points", ha=ha, va="bottom", fontsize=8, color=_CAMERA)  # fmt: skip
    for name, volume in data.resolved.volumes.items():
        (x_low, x_high), (y_low, y_high) = volume.x_m, volume.y_m
        _draw_view(axes, (x_low, y_low), x_high - x_low, y_high - y_low)
        axes.annotate(name, (x_low, y_high), xytext=(3, -3), textcoords="offset points", va="top", fontsize=8,
                      color=_CAMERA)  # fmt: skip


def _draw_view(axes: Axes, corner: tuple[float, float], width: float, depth: float) -> None:
    axes.add_patch(Rectangle(corner, width, depth, fc=_CAMERA, alpha=0.06, lw=0, zorder=0))
    axes.add_patch(Rectangle(corner, width, depth, fill=False, ec=_CAMERA, lw=0.7, ls=":"))


def _footprint_half_m(camera: WorldCamera, height_m: float) -> tuple[float, float]:
    """Return half the width and depth of a camera's view at a height [m along world x, y]."""
    below, lens = max(0.0, camera.position_m[2] - height_m), camera.calibration
    return below * lens.width_px / (2 * lens.fx_px), below * lens.height_px / (2 * lens.fy_px)


def _draw_entity(axes: Axes, data: RunData, name: str, start: float, end: float) -> None:
    color = color_of(name, data).light
    truth, estimate = data.truth.get(name), data.estimates.get(name)
    if truth is not None:
        stretches = [truth.position_m[part, :2] for part in truth.stretches(start, end) if len(part)]
        for path in stretches:  # in between its place is unknown
            axes.plot(path[:, 0], path[:, 1], color=color, lw=1.8, zorder=4, solid_capstyle="round")
        if stretches:
            axes.plot(*stretches[0][0], "o", ms=7, mfc="white", mec=color, mew=1.8, zorder=6)
            axes.plot(*stretches[-1][-1], "s", ms=7, mfc=color, mec="white", mew=1.0, zorder=6)
    if estimate is not None and len(estimate.time_s):
        _draw_estimate(axes, estimate, color, start, end)


def _draw_estimate(axes: Axes, estimate: EstimateTrack, color: str, start: float, end: float) -> None:
    inside = (estimate.time_s >= start) & (estimate.time_s <= end)
    mean = estimate.mean[inside, :2]
    gaps = np.flatnonzero(np.diff(estimate.time_s[inside]) > STALE_S) + 1
    for part in np.split(mean, gaps):
        axes.plot(part[:, 0], part[:, 1], color=color, lw=0.9, ls=(0, (1, 1)), alpha=0.9, zorder=5)
    for index in estimate.latest_at(np.linspace(start, end, _ELLIPSES), STALE_S):
        if index < 0:
            continue
        major, minor, angle = semi_axes_95(*estimate.covariance[index, [0, 0, 1], [0, 1, 1]].tolist())
        x, y = estimate.mean[index, :2]
        ellipse = Ellipse((x, y), 2 * major, 2 * minor, angle=math.degrees(angle), fc=color, ec=color, lw=0.8, zorder=3)
        ellipse.set_facecolor((*ellipse.get_facecolor()[:3], 0.12))
        axes.add_patch(ellipse)


def _legend(data: RunData) -> list[Line2D | Patch]:
    entities: list[Line2D | Patch] = [
        Line2D([], [], color=color_of(name, data).light, lw=2.4, label=name) for name in (*data.drones, *data.tracked)
    ]
    obstacles = [Patch(fc=MUTED, lw=0, label="obstacle")] if data.resolved.room.obstacles else []
    return [
        *entities,
        Line2D([], [], color=MUTED, lw=1.8, label="truth"),
        Line2D([], [], color=MUTED, lw=0.9, ls=(0, (1, 1)), label="estimate"),
        Patch(fc="#dfe5ea", ec=MUTED, lw=0.8, label="95 % ellipse"),
        Line2D([], [], color=MUTED, marker="o", mfc="white", lw=0, label="start of tracking"),
        Line2D([], [], color=MUTED, marker="s", lw=0, label="end"),
        Line2D([], [], color=FENCE_COLOUR.light, lw=1.0, ls="--", label="fence"),
        *obstacles,
        Patch(fc="#eef2e4", ec=_CAMERA, ls=":", lw=0.7, label=_world_view(data)),
    ]


def _world_view(data: RunData) -> str:
    """Return the legend of the dotted boxes."""
    cameras = ["ceiling view\nat level heights"] if data.resolved.cameras else []
    systems = {"motion capture": data.resolved.motion_capture, "ranging": data.resolved.ranging}
    return "\n".join([*cameras, *(name for name, given in systems.items() if given)])
