"""Colours that colour-blind people distinguish (Okabe and Ito), and the look of all plots."""

from typing import Any

from groundstation.report.tracks import RunData

INK = "#1b2733"
MUTED = "#8795a1"
TARGET_COLOR = "#d55e00"
TARGET_COLORS = (TARGET_COLOR, "#7a3400", "#f2a26b")
DRONE_COLORS = ("#0072b2", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#5d4fa2")
KIND_COLORS = {"flat": "#56a3d9", "string": "#e08a1e", "other": "#aab4bd"}

STYLE: Any = {
    "font.size": 10.0,
    "axes.edgecolor": MUTED,
    "axes.labelcolor": INK,
    "axes.titlecolor": INK,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "grid.color": "#e6ebef",
    "grid.linewidth": 0.8,
    "axes.axisbelow": True,
    "xtick.color": MUTED,
    "ytick.color": MUTED,
    "xtick.labelcolor": INK,
    "ytick.labelcolor": INK,
    "legend.frameon": False,
    "legend.fontsize": 9.0,
    "figure.facecolor": "white",
}


def color_of(name: str, data: RunData) -> str:
    """Return the colour of a drone or a target."""
    if name in data.drones:
        return DRONE_COLORS[data.drones.index(name) % len(DRONE_COLORS)]
    number = data.tracked.index(name) if name in data.tracked else 0
    return TARGET_COLORS[number % len(TARGET_COLORS)]
