"""Charts over many runs: team sizes, strategies and sensors side by side."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.patches import Rectangle

from groundstation.experiments.figures import LEVEL_COLOURS, STYLE, TRUTH, save_figure


def save_teams(path: Path, entries: Sequence[dict[str, Any]]) -> None:
    """Save uncertainty and topology depth over team size, one line per strategy and start."""
    lines: dict[str, list[dict[str, Any]]] = {}
    for entry in entries:
        label = entry["strategy"] if entry["strategy"].startswith("fixed") else f"{entry['strategy']}, {entry['start']}"
        lines.setdefault(label, []).append(entry)
    with plt.rc_context(STYLE):
        figure, (left, right) = plt.subplots(1, 2, figsize=(9.5, 3.8))
        for k, (label, own) in enumerate(lines.items()):
            robots = [entry["robots"] for entry in own]
            colour = LEVEL_COLOURS[k % len(LEVEL_COLOURS)]
            # Later lines are thinner, dashed, with hollow markers, so that lines below them stay visible.
            looks = {"color": colour, "marker": "osD^v<>p"[k % 8], "linewidth": max(3.0 - 0.6 * k, 1.0), "label": label}
            looks |= {"markersize": max(9.0 - k, 4.0), "markerfacecolor": "white", "linestyle": "-" if k < 2 else "--"}
            left.plot(robots, [1e3 * np.sqrt(e["mean_trace_m2"]) for e in own], **looks)
            right.plot(robots, [e["levels_last_mean"] for e in own], **looks)
        left.set(xlabel="robots", ylabel="√ mean trace of target [mm]", ylim=(0, None))
        right.set(xlabel="robots", ylabel="levels at the end", ylim=(0, None))
        left.legend(frameon=False)
        figure.tight_layout()
        save_figure(figure, path)


def save_errors(path: Path, rows: Sequence[dict[str, Any]]) -> None:
    """Save the target's RMSE of every run, one column per team size and strategy."""
    groups: dict[str, list[float]] = {}
    for row in rows:
        groups.setdefault(f"{row['task']['robots']} robots\n{row['task']['strategy']}", []).append(
            row["merits"]["rmse_m"]
        )
    with plt.rc_context(STYLE):
        figure, axes = plt.subplots(figsize=(max(4.0, 0.95 * len(groups)), 3.8))
        for k, values in enumerate(groups.values()):
            spread = np.linspace(-0.18, 0.18, len(values)) if len(values) > 1 else [0.0]
            axes.plot(k + np.asarray(spread), values, "o", color=LEVEL_COLOURS[k % 3], markersize=3, alpha=0.6)
            axes.plot([k - 0.28, k + 0.28], [np.median(values)] * 2, color=TRUTH, linewidth=1.6)
        axes.set_xticks(range(len(groups)), list(groups), fontsize=7)
        axes.set(ylabel="RMSE of target [m]", ylim=(0, None))
        figure.tight_layout()
        save_figure(figure, path)


def save_sensors(path: Path, rows: Sequence[dict[str, Any]]) -> None:
    """Save, per sensor, the uncertainty of every topology relative to the best one; the winner is framed."""
    sensors = list(dict.fromkeys(row["sensor"] for row in rows))
    levels = sorted({row["levels"] for row in rows}, key=lambda text: (text.count("-"), text))
    best = {row["sensor"]: row["mean_trace_m2"] for row in rows if row["wins"]}
    grid = np.full((len(sensors), len(levels)), np.nan)
    for row in rows:
        grid[sensors.index(row["sensor"]), levels.index(row["levels"])] = row["mean_trace_m2"] / best[row["sensor"]]
    with plt.rc_context(STYLE):
        figure, axes = plt.subplots(figsize=(1.6 + 0.52 * len(levels), 1.6 + 0.42 * len(sensors)))
        image = axes.imshow(np.log10(grid), cmap="viridis_r", vmin=0.0, vmax=2.0, aspect="auto")
        for a in range(len(sensors)):
            for b in range(len(levels)):
                value = grid[a, b]
                text = f"{value:.2f}" if value < 9.95 else f"{value:.0f}" if value < 999 else ">999"
                colour = "white" if value > 6 else "black"
                weight = "bold" if value == 1.0 else "normal"
                axes.text(b, a, text, ha="center", va="center", fontsize=6, color=colour, weight=weight)
            winner = int(np.nanargmin(grid[a]))
            axes.add_patch(Rectangle((winner - 0.5, a - 0.5), 1, 1, fill=False, edgecolor="#D55E00", linewidth=2))
        axes.set_xticks(range(len(levels)), levels, rotation=60, ha="right")
        axes.set_yticks(range(len(sensors)), sensors)
        axes.set_xlabel("robots per level, from the global sensor to the target")
        axes.spines[:].set_visible(False)
        bar = figure.colorbar(image, ax=axes, ticks=[0, 1, 2], pad=0.02)
        bar.ax.set_yticklabels(["1", "10", "≥100"])
        bar.set_label("mean trace, relative to the best")
        figure.tight_layout()
        save_figure(figure, path)
