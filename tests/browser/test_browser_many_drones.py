"""Eight drones: all are visible, their texts fit, and they can be told apart though colours repeat."""

import re
from typing import Any

import pytest
from clipping import clipped, covered, overhanging
from fake_flight import TARGET
from situations import SITUATIONS

pytestmark = [pytest.mark.browser, pytest.mark.slow]

SIZES = ((1440, 900), (1280, 800), (2560, 1440), (390, 844))
# Whether texts of the bar overlap.
OVERLAID = """() => { const boxes = [...document.querySelectorAll(".readings :is(dt, dd)")].map((one) => {
  const words = document.createRange(); words.selectNodeContents(one); return words.getBoundingClientRect(); });
  return boxes.some((a, index) => boxes.slice(index + 1).some((b) =>
    a.left < b.right - 1 && b.left < a.right - 1 && a.top < b.bottom - 4 && b.top < a.bottom - 4)); }"""
BELOW = """() => [...document.querySelectorAll(".unit")].filter((one) => {
  const panel = document.querySelector(".crew").getBoundingClientRect(), box = one.getBoundingClientRect();
  return box.bottom > Math.min(panel.bottom, innerHeight) + 1; }).map((one) => one.ariaLabel)"""


def all_at_once(flight: Any) -> None:
    """Drones that land, hold, hover, stand and are lost, while others track."""
    doing = ("TRACK", "TRACK", "HOLD", "LANDING", "LANDED", "TRACK", "TRACK", "HOVER")
    flight.modes = dict(zip(flight.drones, doing, strict=True))
    flight.unseen_s["drone_6"] = 4.0


def one_crashed(flight: Any) -> None:
    SITUATIONS["all_is_well"](flight)
    flight.modes["drone_2"] = "CUT"


def test_each_of_eight_has_its_card_in_sight_and_words_that_have_room(large_stage: Any) -> None:
    page, flight = large_stage.open(), large_stage.flight
    for arrange in (one_crashed, all_at_once):
        arrange(flight)
        for width, height in SIZES:
            page.page.set_viewport_size({"width": width, "height": height})
            page.page.wait_for_timeout(700)
            assert overhanging(page.page) == covered(page.page) == [], (arrange, width)
            assert not page.page.evaluate(OVERLAID), (arrange, width)
            if width == 1280:  # where two columns have no room, the team scrolls in its panel
                continue
            assert clipped(page.page) == [], (arrange, width)
            assert width < 1000 or page.page.evaluate(BELOW) == [], (arrange, width)


def test_activities_of_eight_drones_are_counted_and_lost_ones_named(large_stage: Any) -> None:
    page, flight = large_stage.open(), large_stage.flight
    all_at_once(flight)
    page.wait(lambda s: page.there("team-mode").inner_text() == "LANDING")
    page.wait(lambda s: page.there("team-who").inner_text() == "drone_4; others HOLD, HOVER, TRACK")
    one_crashed(flight)
    page.wait(lambda s: page.there("team-who").inner_text() == "drone_2; others TRACK")
    page.wait(lambda s: page.there("team-mode").inner_text() == "MOTORS OFF")
    all_at_once(flight)
    page.wait(lambda s: page.there("team-mode").inner_text() == "LANDING")
    page.wait(lambda s: page.there("hold").inner_text() == "HOLD\n5 hover;\nothers land")
    told = "4 track the target; 2 hover; 1 lands; 1 stands. Lost: drone_6, not seen for 4 s."
    page.wait(lambda s: page.there("verdict").inner_text().startswith(told))
    page.wait(lambda s: page.there("drone_6-mode").inner_text() == "lost")
    flight.modes = dict.fromkeys(flight.drones, "TRACK")
    flight.unseen_s = dict.fromkeys((*flight.drones, TARGET), 5.0)
    lost = re.compile(r"^8 look for the target\. Lost: 8 drones and turtlebot, not seen for 5 s\.")
    page.wait(lambda s: lost.search(page.there("verdict").inner_text()))


def test_drones_of_one_colour_have_different_signs(large_stage: Any) -> None:
    page = large_stage.open()
    chip = "(name) => document.querySelector(`[data-testid=card-${name}] .chip`).innerHTML"
    signs = [page.page.evaluate(chip, name) for name in large_stage.flight.drones]
    assert len(set(signs)) == len(signs)
