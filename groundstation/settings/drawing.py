"""Draws a field to scale from above and from the side: views of fixed cameras by level height, and of drones."""

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Any, BinaryIO

import numpy as np

from groundstation.arrays import Array
from groundstation.settings.room import ObstacleSettings, WorldCameraSettings
from groundstation.settings.schema import Field

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Paths = dict[str, list[tuple[float, float]]]

_LEVEL_COLOURS = ("tab:blue", "tab:orange", "tab:green", "tab:purple", "tab:brown")
_TARGET_COLOUR = "tab:red"
_OBSTACLE_COLOUR = "dimgrey"


@dataclass(frozen=True, slots=True)
class Shade:
    """Figures over the floor: middles of cells along x and y [m; world], values (rows: y, columns: x), their title.

    nan: none, which is hatched.
    """

    xs: Array
    ys: Array
    values: Array
    label: str


def draw(field: Field, output: Path | BinaryIO, paths: Paths | None = None, shade: Shade | None = None) -> None:
    """Write a picture of the field (PNG, SVG or PDF by the file's ending); paths: those of `paths_of`."""
    kind = output.suffix[1:] if isinstance(output, Path) else "svg"
    _figure(field, paths or {}, shade).savefig(output, dpi=110, format=kind)


def svg_of(field: Field, paths: Paths, shade: Shade) -> str:
    """Return the picture as SVG."""
    buffer = BytesIO()
    draw(field, buffer, paths, shade)
    return buffer.getvalue().decode()


def _figure(field: Field, paths: Paths, shade: Shade | None) -> "Figure":
    from matplotlib.figure import Figure

    width, depth, height = field.room.size_m
    figure = Figure(figsize=(width * 1.15 + 0.6, (depth + height) * 1.15 + 1.6), layout="constrained")
    top, side = figure.subplots(2, 1, sharex=True, height_ratios=(depth, height))
    if shade is not None:
        _draw_shade(figure, top, shade)
    _draw_top(top, field, paths)
    _draw_side(side, field, paths)
    for axes, (low, high), label in ((top, (-depth / 2, depth / 2), "y [m]"), (side, (0.0, height), "z [m]")):
        axes.set(xlim=(-width / 2, width / 2), ylim=(low, high), ylabel=label, aspect="equal")
        axes.grid(alpha=0.25)
    side.set_xlabel("x [m]")
    figure.suptitle(f"{field.site}: {width:g} x {depth:g} x {height:g} m")
    return figure


def _draw_shade(figure: "Figure", axes: "Axes", shade: Shade) -> None:
    """Draw figures as colours under all else, and hatch cells without one."""
    mesh = axes.pcolormesh(shade.xs, shade.ys, shade.values, cmap="viridis_r", shading="nearest", alpha=0.6)
    figure.colorbar(mesh, ax=axes, label=shade.label, fraction=0.04, pad=0.01)
    dx, dy = shade.xs[1] - shade.xs[0], shade.ys[1] - shade.ys[0]
    label: str | None = "not seen"
    for j, i in zip(*np.nonzero(np.isnan(shade.values)), strict=True):
        x, y = float(shade.xs[i]), float(shade.ys[j])
        _hatch(axes, (x - dx / 2, x + dx / 2), (y - dy / 2, y + dy / 2), label)
        label = None


def _hatch(axes: "Axes", x: tuple[float, float], y: tuple[float, float], label: str | None) -> None:
    from matplotlib.patches import Rectangle

    size = x[1] - x[0], y[1] - y[0]
    axes.add_patch(Rectangle((x[0], y[0]), *size, fill=False, hatch="///", edgecolor="silver", lw=0, label=label))


def paths_of(scenario: Mapping[str, Any], targets: Iterable[str]) -> Paths:
    """Return points of each target's path in a scenario [m; world]; none for a target that waits or wanders."""
    own, common = scenario.get("targets", {}), scenario.get("target", {})
    return {name: _points(own.get(name, common).get("path", {})) for name in targets}


def beyond_walls(field: Field, paths: Paths) -> list[str]:
    """Return a sentence for each target whose path leaves the room."""
    width, depth, _ = field.room.size_m
    found = []
    for name, points in paths.items():
        x, y = (max((abs(point[axis]) for point in points), default=0.0) for axis in (0, 1))
        if x > width / 2 or y > depth / 2:
            found.append(
                f"the path of {name} leaves the room: up to x {x:.1f}, y {y:.1f} m from its middle, walls at "
                f"{width / 2:g} and {depth / 2:g} m; set its path in a scenario of your own"
            )
    return found


def _points(path: Mapping[str, Any]) -> list[tuple[float, float]]:
    if path.get("shape") == "waypoints":
        points = [(float(x), float(y)) for x, y in path["points_m"]]
        return [*points, points[0]] if path.get("after_last", "first") == "first" else points
    if path.get("shape") != "figure_eight":
        return []
    return [on_figure_eight(path, n / 200) for n in range(201)]


def on_figure_eight(path: Mapping[str, Any], turns: float) -> tuple[float, float]:
    """Return the point of a figure of eight after some turns from its middle [m; world]."""
    phase, (x, y) = math.tau * turns, path.get("centre_m", (0.0, 0.0))
    length, width = path.get("half_length_m", 0.0), path.get("half_width_m", 0.0)
    return x + length * math.sin(phase), y + width * math.sin(2 * phase)


def level_heights(field: Field) -> list[float]:
    """Return the level heights of the whole team's topologies, highest first [m]."""
    rows = field.planner.level_heights_m[: len(field.drones)]
    return sorted({height for row in rows for height in row}, reverse=True)


def footprint(camera: WorldCameraSettings, height_m: float) -> tuple[float, float]:
    """Return half the length (x) and width (y) of a downward camera's view at a height, undistorted [m]."""
    distance = max(0.0, camera.position_m[2] - height_m)
    lens = camera.calibration
    return (
        distance * math.tan(lens.horizontal_view_rad / 2),
        distance * math.tan(lens.vertical_view_rad / 2),
    )


def marker_height(field: Field, level_m: float) -> float:
    """Return the height of a drone's marker at a flight height [m; world], the highest of the team."""
    return level_m + max(drone.marker.position_m[2] for drone in field.drones.values())


def _draw_top(axes: "Axes", field: Field, paths: Paths) -> None:
    fence = field.room.fence
    _box(axes, fence.x_m, fence.y_m, linestyle="--", edgecolor="grey", label="fence")
    for name, one in field.room.obstacles.items():
        xs, ys = _sides(one)
        _box(axes, xs, ys, edgecolor=_OBSTACLE_COLOUR, label=f"{name}, {one.size_m[2]:g} m high", filled=True)
    for name, camera in field.cameras.items():
        x, y, _ = camera.position_m
        axes.plot(x, y, "k^", label=f"camera {name}")
        for level, colour in zip(level_heights(field), _LEVEL_COLOURS, strict=False):
            length, width = footprint(camera, marker_height(field, level))
            label = f"a drone at {level:g} m is seen by {name}"
            _box(axes, (x - length, x + length), (y - width, y + width), edgecolor=colour, label=label)
    for name, volume in field.volumes.items():
        _box(axes, volume.x_m, volume.y_m, linestyle=":", edgecolor="black", label=f"seen by {name}")
    for name, drone in field.drones.items():
        heading = drone.pad_yaw_rad
        axes.plot(*drone.pad_m, "ko", markerfacecolor="none")
        axes.annotate(name, drone.pad_m, textcoords="offset points", xytext=(6, 6))
        axes.arrow(*drone.pad_m, 0.3 * math.cos(heading), 0.3 * math.sin(heading), head_width=0.08, color="black")
    for name, points in paths.items():
        if points:
            axes.plot(*zip(*points, strict=True), color=_TARGET_COLOUR, label=f"path of {name}")
    axes.legend(loc="upper right", fontsize="small")


def _draw_side(axes: "Axes", field: Field, paths: Paths) -> None:
    fence = field.room.fence
    _box(axes, fence.x_m, fence.z_m, linestyle="--", edgecolor="grey")
    for one in field.room.obstacles.values():
        _box(axes, _sides(one)[0], (0.0, one.size_m[2]), edgecolor=_OBSTACLE_COLOUR, filled=True)
    for camera in field.cameras.values():
        x, _, z = camera.position_m
        length, _ = footprint(camera, 0.0)
        axes.fill([x, x - length, x + length], [z, 0.0, 0.0], color="grey", alpha=0.12)
        axes.plot(x, z, "k^")
    for volume in field.volumes.values():
        _box(axes, volume.x_m, volume.z_m, linestyle=":", edgecolor="black")
    boards = {name: target.marker.height_m for name, target in field.tracked.items()}
    for name, board in boards.items():
        along = [x for x, _ in paths.get(name, [])] or [0.0]
        axes.plot((min(along), max(along)), (board, board), color=_TARGET_COLOUR, marker="s", markersize=4)
    for level, colour in zip(level_heights(field), _LEVEL_COLOURS, strict=False):
        axes.axhline(level, color=colour, linewidth=0.8)
        axes.annotate(f"level {level:g} m", (fence.x_m[0], level), textcoords="offset points", xytext=(3, 3))
    _draw_view(axes, field, max(boards.values()))


def _draw_view(axes: "Axes", field: Field, board_m: float) -> None:
    """Draw the first drone at its lowest level, behind the (highest) target at the distance that its tilt needs."""
    drone = next(iter(field.drones.values()))
    camera, level = drone.camera, level_heights(field)[-1]
    height = level + camera.position_m[2] - board_m
    tilt = camera.tilt_down_rad
    if height <= 0 or not 0 < tilt < math.pi / 2:
        return
    x = -height / math.tan(tilt)
    half = camera.calibration.vertical_view_rad / 2
    edges = [min(max(tilt + side * half, 0.05), math.pi - 0.05) for side in (-1, 1)]
    ends = [x + height / math.tan(edge) for edge in edges]
    axes.fill([x, *ends], [level + camera.position_m[2], board_m, board_m], color="tab:cyan", alpha=0.25)
    axes.plot(x, level, "ko", markerfacecolor="none")
    axes.plot(0.0, board_m, color=_TARGET_COLOUR, marker="s")


def _sides(box: ObstacleSettings) -> tuple[tuple[float, float], tuple[float, float]]:
    (x, y), (width, depth, _) = box.centre_m, box.size_m
    return (x - width / 2, x + width / 2), (y - depth / 2, y + depth / 2)


def _box(
    axes: "Axes",
    x: tuple[float, float],
    y: tuple[float, float],
    edgecolor: str,
    linestyle: str = "-",
    label: str | None = None,
    filled: bool = False,
) -> None:
    from matplotlib.patches import Rectangle

    size = x[1] - x[0], y[1] - y[0]
    box = Rectangle((x[0], y[0]), *size, fill=filled, label=label, edgecolor=edgecolor, linestyle=linestyle)
    if filled:
        box.set(facecolor=edgecolor, alpha=0.35)
    axes.add_patch(box)
