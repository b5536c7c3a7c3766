"""Colours of robots and targets are distinct and readable on light and dark ground, also for the colour-blind."""

import re
from itertools import combinations
from pathlib import Path

import numpy as np
import pytest

from groundstation.appearance.colours import (
    FENCE_COLOUR,
    NEUTRAL_COLOUR,
    ROBOT_COLOURS,
    TARGET_COLOURS,
    Colour,
    colours_of,
    rgb,
)
from groundstation.arrays import Array

STATIC = Path(__file__).parents[3] / "groundstation" / "console" / "static"
TEAM = (*ROBOT_COLOURS, *TARGET_COLOURS)
USUAL = (*ROBOT_COLOURS[:3], TARGET_COLOURS[0])
# Machado, Oliveira, Fernandes: A physiologically-based model for simulation of color vision deficiency, IEEE TVCG
# 15(6), 2009, severity 1.0; for linear sRGB.
VISIONS = {
    "normal": np.eye(3),
    "protanopia": np.array(
        [[0.152286, 1.052583, -0.204868], [0.114503, 0.786281, 0.099216], [-0.003882, -0.048116, 1.051998]]
    ),
    "deuteranopia": np.array(
        [[0.367322, 0.860646, -0.227968], [0.280085, 0.672501, 0.047413], [-0.011820, 0.042940, 0.968881]]
    ),
}
# IEC 61966-2-1: linear sRGB to XYZ, and its white.
XYZ_FROM_RGB = np.array([[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]])
WHITE = XYZ_FROM_RGB.sum(axis=1)
# CIE76 distances. 2.3 is just noticeable side by side; thin lines far apart need several times as much.
LEAST, LEAST_USUAL = 18.0, 30.0
TEXT, MARK = 4.5, 3.0  # WCAG 2.2, 1.4.3 and 1.4.11


def linear(shade: str) -> Array:
    parts = np.array(rgb(shade)) / 255
    return np.where(parts <= 0.04045, parts / 12.92, ((parts + 0.055) / 1.055) ** 2.4)


def lab(shade: str, vision: str) -> Array:
    seen = np.clip(VISIONS[vision] @ linear(shade), 0.0, 1.0)
    ratio = XYZ_FROM_RGB @ seen / WHITE
    x, y, z = np.where(ratio > (6 / 29) ** 3, np.cbrt(ratio), ratio * (29 / 6) ** 2 / 3 + 4 / 29)
    return np.array([116 * y - 16, 500 * (x - y), 200 * (y - z)])


def contrast(one: str, other: str) -> float:
    """Return the contrast ratio of WCAG 2.2."""
    low, high = sorted(float(XYZ_FROM_RGB[1] @ linear(shade)) for shade in (one, other))
    return (high + 0.05) / (low + 0.05)


def grounds(theme: str) -> dict[str, str]:
    """Return the page's background colours in a theme, from its style sheet."""
    selector = ":root" if theme == "light" else r':root\[data-theme="dark"\]'
    found = re.search(selector + r" \{(.*?)\}", (STATIC / "style.css").read_text(), re.DOTALL)
    assert found
    return dict(re.findall(r"--(floor|panel|bg|outside): (#\w{6})", found[1]))


def hue_deg(shade: str) -> float:
    _, a, b = lab(shade, "normal")
    return float(np.degrees(np.arctan2(b, a)))


def shades(colours: tuple[Colour, ...], theme: str) -> list[str]:
    return [getattr(colour, theme) for colour in colours]


def test_the_simulation_is_what_it_should_be() -> None:
    assert lab("#ffffff", "protanopia") == pytest.approx([100, 0, 0], abs=0.1)
    # A red and a green that dichromats confuse, and that others do not.
    red, green = "#b02010", "#5a5a00"
    normal, blind = (np.linalg.norm(lab(red, kind) - lab(green, kind)) for kind in ("normal", "protanopia"))
    assert normal > 50 and blind < 25


@pytest.mark.parametrize("vision", VISIONS)
@pytest.mark.parametrize("theme", ["light", "dark"])
@pytest.mark.parametrize(("team", "least"), [(TEAM, LEAST), (USUAL, LEAST_USUAL)])
def test_any_two_can_be_told_apart(team: tuple[Colour, ...], least: float, theme: str, vision: str) -> None:
    for one, other in combinations(shades(team, theme), 2):
        assert np.linalg.norm(lab(one, vision) - lab(other, vision)) >= least, (one, other)


@pytest.mark.parametrize("theme", ["light", "dark"])
def test_names_can_be_read_where_they_are_written(theme: str) -> None:
    ground = grounds(theme)
    assert set(ground) == {"floor", "panel", "bg", "outside"}
    for shade in shades((*TEAM, NEUTRAL_COLOUR), theme):
        assert min(contrast(shade, ground[name]) for name in ("floor", "panel")) >= TEXT, shade
    for shade in shades((*TEAM, FENCE_COLOUR), theme):
        assert min(contrast(shade, one) for one in ground.values()) >= MARK, shade


def test_engineering_views_are_dark_enough() -> None:
    # RViz has #303030, Rerun and Foxglove are darker.
    assert min(contrast(shade, "#303030") for shade in shades(TEAM, "dark")) >= MARK


def test_both_shades_have_one_hue() -> None:
    for colour in TEAM:
        turn = abs(hue_deg(colour.light) - hue_deg(colour.dark)) % 360
        assert min(turn, 360 - turn) <= 35, colour


def test_names_take_colours_in_order_and_begin_anew() -> None:
    found = colours_of([f"drone_{number}" for number in range(7)], ["a", "b", "c"])
    assert found["drone_1"] == ROBOT_COLOURS[1] and found["drone_6"] == ROBOT_COLOURS[0]
    assert (found["b"], found["c"]) == (TARGET_COLOURS[1], TARGET_COLOURS[0])


def test_the_page_has_no_table_of_its_own() -> None:
    """The page knows only the colours of the theme: those of entities come with the scene."""
    written = {
        shade.lower() for path in STATIC.rglob("*.js") if "vendor" not in path.parts
        for shade in re.findall(r"#[0-9a-fA-F]{6}\b", path.read_text())
    }  # fmt: skip
    ours = {shade for colour in (*TEAM, FENCE_COLOUR) for shade in (colour.light, colour.dark)}
    assert not written & ours
