"""The colour of each robot and target, the same in page, report, plots and engineering views.

Each has two shades of one hue, for light and for dark ground, that also colour-blind people tell apart.
"""

from collections.abc import Iterable
from itertools import cycle

import msgspec

Rgb = tuple[int, int, int]


class Colour(msgspec.Struct, frozen=True):
    """One hue as `#rrggbb`: the shade for light ground and the shade for dark ground."""

    light: str
    dark: str


# Blue, orange, teal, plum, azure, brown; red, clay: a search found them, for the greatest least distance in normal
# vision, protanopia and deuteranopia.
ROBOT_COLOURS = (
    Colour("#06679b", "#2f93fb"),
    Colour("#c84812", "#ff9a2e"),
    Colour("#008174", "#35f0dc"),
    Colour("#5d2657", "#cc66ad"),
    Colour("#2470d2", "#9cc4ff"),
    Colour("#5f3600", "#f6ee86"),
)
TARGET_COLOURS = (Colour("#6a1e25", "#dd5f5c"), Colour("#a55d44", "#f2bd94"))
FENCE_COLOUR = Colour("#b3261e", "#ff8a80")
NEUTRAL_COLOUR = Colour("#16202a", "#e7edf3")
"""What belongs to no robot and no target, and who is not in the field."""


def colours_of(robots: Iterable[str], targets: Iterable[str]) -> dict[str, Colour]:
    """Return the colour of each name; names in the order of the field, so that all views agree."""
    return dict([*zip(robots, cycle(ROBOT_COLOURS), strict=False), *zip(targets, cycle(TARGET_COLOURS), strict=False)])


def rgb(shade: str) -> Rgb:
    """Return red, green and blue (0 to 255) of `#rrggbb`."""
    red, green, blue = bytes.fromhex(shade.removeprefix("#"))
    return red, green, blue
