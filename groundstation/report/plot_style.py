"""The style of all plots and charts; colours of robots and targets are those of `groundstation.appearance`."""

from typing import Any

from groundstation.appearance.colours import NEUTRAL_COLOUR, ROBOT_COLOURS, Colour, colours_of
from groundstation.report.tracks import RunData

INK = "#1b2733"
MUTED = "#8795a1"
MUTED_CURVE = Colour(MUTED, MUTED)
# Lines of neither robots nor targets, such as runs and processes.
SERIES_COLORS = ROBOT_COLOURS
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


def color_of(name: str, data: RunData) -> Colour:
    """Return the colour of a drone or a target."""
    return colours_of(data.drones, data.tracked).get(name, NEUTRAL_COLOUR)
