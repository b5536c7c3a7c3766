"""Pictures of planar runs: topology with its information, trajectories with ellipses, teams, sensors, an animation.

This module imports matplotlib, and is itself imported only to draw a picture.
"""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import matplotlib

matplotlib.use("Agg")

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.animation import FuncAnimation, PillowWriter
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.patches import Circle

from groundstation.experiments.closed_loop import SimulatedStep, edges_of
from groundstation.experiments.planar.parameters import PlanarParameters

# Colour-blind safe (Okabe, Ito 2008): one per level, the target in black.
LEVEL_COLOURS = ("#0072B2", "#E69F00", "#009E73", "#CC79A7", "#56B4E9", "#D55E00")
TRUTH, ESTIMATE, FAINT = "#222222", "#D55E00", "#BBBBBB"
_SIGMAS = 3.0
_MARGIN_M = 0.12
STYLE: dict[Any, Any] = {
    "font.size": 9,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "figure.dpi": 130,
    "savefig.dpi": 130,
}


def level_colour(level: int) -> str:
    """Return the colour of a level, 0 on top."""
    return LEVEL_COLOURS[level % len(LEVEL_COLOURS)]


def information(step: SimulatedStep, parameters: PlanarParameters, observer: int, subject: int) -> float:
    """Return the information of an edge's reading at the mean [1/m^2]; the global sensor is observer -1."""
    offset = step.mean[subject] - (step.mean[observer] if observer >= 0 else 0.0)
    exponent = min((float(np.hypot(*offset)) - parameters.range_m) / parameters.softness_m, 40.0)
    return float(1.0 / (parameters.sigma_m**2 * (1.0 + np.exp(exponent))))


def draw_map(axes: Axes, step: SimulatedStep, parameters: PlanarParameters, range_m: float) -> None:
    """Draw one step: edges as thick as their information, robots by level with ellipses, target true and estimated."""
    most = 1.0 / parameters.sigma_m**2
    axes.add_patch(Circle((0.0, 0.0), range_m, color="#F0F0F0", zorder=0))
    axes.plot(0.0, 0.0, marker="s", color=TRUTH, markersize=6, zorder=4)
    for observer, subject in edges_of(step.level):
        share = information(step, parameters, observer, subject) / most
        a = step.mean[observer] if observer >= 0 else np.zeros(2)
        b = step.mean[subject]
        axes.plot(*zip(a, b, strict=True), color="#666666", linewidth=0.3 + 2.2 * share, alpha=0.15 + 0.55 * share)
    for robot, level in enumerate(step.level):
        colour = level_colour(int(level))
        _ellipse(axes, step, robot, colour)
        axes.plot(*step.mean[robot], marker="o", color=colour, markersize=6, markeredgecolor="white", zorder=5)
    target = len(step.level)
    _ellipse(axes, step, target, ESTIMATE)
    axes.plot(*step.truth[target], marker="*", color=TRUTH, markersize=11, markeredgecolor="white", zorder=6)
    axes.plot(*step.mean[target], marker="x", color=ESTIMATE, markersize=6, markeredgewidth=2, zorder=7)


def _ellipse(axes: Axes, step: SimulatedStep, entity: int, colour: str) -> None:
    """Draw the 3 sigma ellipse of a position: a circle, because the planar filter is isotropic."""
    radius = _SIGMAS * float(np.sqrt(step.covariance[entity, entity]))
    axes.add_patch(Circle(tuple(step.mean[entity]), radius, facecolor=colour, alpha=0.22, edgecolor=colour, zorder=3))


def draw_levels(axes: Axes, step: SimulatedStep, parameters: PlanarParameters) -> None:
    """Draw the topology as the paper does: global sensor on top, target at the bottom, links by information."""
    most, depth = 1.0 / parameters.sigma_m**2, int(step.level.max()) + 2
    place = {-1: (0.0, 0.0), len(step.level): (0.0, -float(depth))}
    for level in range(depth - 1):
        members = np.flatnonzero(step.level == level)
        across = np.linspace(-1.0, 1.0, 2 * len(members) + 1)[1::2]
        place |= {int(m): (float(x), -level - 1.0) for m, x in zip(members, across, strict=True)}
    for observer, subject in edges_of(step.level):
        share = information(step, parameters, observer, subject) / most
        axes.plot(*zip(place[observer], place[subject], strict=True), color="#666666", linewidth=0.4 + 3.0 * share)
    for entity, (x, y) in place.items():
        if 0 <= entity < len(step.level):
            axes.plot(x, y, "o", color=level_colour(int(step.level[entity])), markersize=13, markeredgecolor="white")
            axes.text(x, y - 0.02, str(entity + 1), color="white", ha="center", va="center", fontsize=7, weight="bold")
    axes.plot(*place[-1], "s", color=TRUTH, markersize=9)
    axes.plot(*place[len(step.level)], "*", color=TRUTH, markersize=14)
    axes.set_xlim(-1.1, 1.1)
    axes.set_ylim(-depth - 0.4, 0.4)
    axes.axis("off")


def _legend(figure: Any, levels: int) -> None:
    handles = [
        Line2D([], [], marker="s", color=TRUTH, linestyle="", label="global sensor"),
        *(
            Line2D([], [], marker="o", color=level_colour(k), linestyle="", label=f"level {k + 1}")
            for k in range(levels)
        ),
        Line2D([], [], marker="*", color=TRUTH, linestyle="", markersize=10, label="target"),
        Line2D([], [], marker="x", color=ESTIMATE, linestyle="", markeredgewidth=2, label="estimate, 3σ"),
    ]
    figure.legend(handles=handles, loc="lower center", ncols=len(handles), frameon=False)


def _limits(steps: Sequence[SimulatedStep]) -> tuple[tuple[float, float], tuple[float, float]]:
    points = np.vstack([*(step.truth for step in steps), np.zeros((1, 2))])
    low, high = points.min(axis=0) - _MARGIN_M, points.max(axis=0) + _MARGIN_M
    return (float(low[0]), float(high[0])), (float(low[1]), float(high[1]))


def save_topologies(path: Path, steps: Sequence[SimulatedStep], parameters: PlanarParameters, range_m: float) -> None:
    """Save the run at four moments: levels above, map below (the paper's Fig. 1).

    The first and third decision, then where the target is farthest in the first half and in the whole run.
    """
    distance = [float(np.hypot(*step.truth[-1])) for step in steps]
    half = len(steps) // 2 + 1
    moments = [0, min(2, len(steps) - 1), int(np.argmax(distance[:half])), len(steps) - 1]
    if distance[-1] < max(distance) / 2.0:
        moments[3] = half - 1 + int(np.argmax(distance[half - 1 :]))
    with plt.rc_context(STYLE):
        figure, grid = plt.subplots(2, 4, figsize=(11, 6.2), height_ratios=(1.0, 1.0))
        x, y = _limits(steps)
        side = max(x[1] - x[0], y[1] - y[0]) / 2.0
        centre = ((x[0] + x[1]) / 2.0, (y[0] + y[1]) / 2.0)
        for column, moment in enumerate(moments):
            step = steps[moment]
            draw_levels(grid[0, column], step, parameters)
            reach = float(np.hypot(*step.truth[-1]))
            grid[0, column].set_title(f"decision {moment + 1}: target at {reach:.2f} m")
            draw_map(grid[1, column], step, parameters, range_m)
            grid[1, column].set_xlim(centre[0] - side, centre[0] + side)
            grid[1, column].set_ylim(centre[1] - side, centre[1] + side)
            grid[1, column].set_aspect("equal")
            grid[1, column].set_xlabel("x [m]")
        grid[1, 0].set_ylabel("y [m]")
        _legend(figure, max(int(steps[m].level.max()) + 1 for m in moments))
        figure.tight_layout(rect=(0, 0.05, 1, 1))
        save_figure(figure, path)


def save_trajectories(path: Path, steps: Sequence[SimulatedStep], title: str) -> None:
    """Save trajectories: truth, estimate with ellipses, robots; and levels, error and trace over time."""
    truth = np.array([step.truth[-1] for step in steps])
    mean = np.array([step.mean[-1] for step in steps])
    with plt.rc_context(STYLE):
        figure = plt.figure(figsize=(11, 5.2), layout="constrained")
        grid = figure.add_gridspec(3, 2, width_ratios=(1.5, 1.0))
        axes = figure.add_subplot(grid[:, 0])
        for robot in range(len(steps[0].level)):
            axes.plot(*np.array([step.truth[robot] for step in steps]).T, color=FAINT, linewidth=0.8, zorder=1)
        for step in steps[:: max(1, len(steps) // 16)]:
            _ellipse(axes, step, len(step.level), ESTIMATE)
        axes.plot(*truth.T, color=TRUTH, linewidth=1.6, label="target", zorder=4)
        axes.plot(*mean.T, color=ESTIMATE, linewidth=1.2, label="estimate, 3σ", zorder=5)
        axes.plot([], [], color=FAINT, label="robots")
        axes.plot(0.0, 0.0, marker="s", color=TRUTH, linestyle="", label="global sensor")
        axes.set(xlabel="x [m]", ylabel="y [m]", title=title, aspect="equal")
        figure.legend(*axes.get_legend_handles_labels(), frameon=False, loc="outside lower left", ncols=4)
        _histories(figure, grid, steps)
        save_figure(figure, path)


def _histories(figure: Any, grid: Any, steps: Sequence[SimulatedStep]) -> None:
    levels = [int(step.level.max()) + 1 for step in steps]
    error = [step.error_m for step in steps]
    sigma = [_SIGMAS * float(np.sqrt(step.trace / 2.0)) for step in steps]
    for row, (values, label) in enumerate(((levels, "levels"), (error, "error [m]"), (sigma, "3σ of target [m]"))):
        axes = figure.add_subplot(grid[row, 1])
        axes.plot(values, color=TRUTH, linewidth=1.2, drawstyle="steps-post" if row == 0 else "default")
        axes.set_ylabel(label)
        axes.set_ylim(bottom=0)
        if row == 0:
            axes.set_yticks(range(max(levels) + 1))
    axes.set_xlabel("step")


def save_animation(path: Path, steps: Sequence[SimulatedStep], parameters: PlanarParameters, range_m: float) -> None:
    """Save the run as an animated GIF, at most about 100 frames."""
    shown = steps[:: max(1, len(steps) // 90)]
    x, y = _limits(steps)
    with plt.rc_context({**STYLE, "figure.dpi": 80, "savefig.dpi": 80}):
        height = 6.4 * (y[1] - y[0]) / (x[1] - x[0])
        figure, axes = plt.subplots(figsize=(6.4, min(max(height, 2.8), 6.4)), layout="constrained")

        def frame(index: int) -> list[Any]:
            axes.clear()
            draw_map(axes, shown[index], parameters, range_m)
            axes.set(xlim=x, ylim=y, aspect="equal", xlabel="x [m]", ylabel="y [m]")
            levels = int(shown[index].level.max()) + 1
            axes.set_title(f"{levels} level{'s' if levels > 1 else ''}, error {shown[index].error_m:.3f} m")
            return []

        animation = FuncAnimation(figure, frame, frames=len(shown))
        path.parent.mkdir(parents=True, exist_ok=True)
        animation.save(path, writer=PillowWriter(fps=12))
        plt.close(figure)


def save_figure(figure: Any, path: Path) -> None:
    """Save and close a figure; without the date or version, so that equal runs give equal files."""
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, metadata={"Software": None})
    plt.close(figure)
