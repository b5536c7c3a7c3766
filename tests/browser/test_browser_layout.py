"""What stops and warns keeps its place, nothing is cut off at any size, and the bar says what the team does."""

from typing import Any

import pytest
from fake_flight import TARGET
from seen_page import Seen
from situations import SITUATIONS

from groundstation.bus.messages import Severity

pytestmark = [pytest.mark.browser, pytest.mark.slow]

FIXED = ("hold", "land-all", "cut-motors", "take-off", "track", "resume", "team", "map")
# Elements whose content sticks out of them; inner_text returns what is cut off as well. Half a pixel is rounding.
CUT_OFF = """() => [...document.querySelectorAll(
    "button, dd, dt, .pill, .banner, .verdict, .brand, .stages li, h2, figcaption, .order, #team strong, .detail")]
  .filter((node) => node.clientWidth > 0 &&
    (node.scrollWidth > node.clientWidth + 1 || node.scrollHeight > node.clientHeight + 2))
  .map((node) => `${node.className || node.tagName}: ${node.textContent}`)"""
OUTSIDE = """() => [...document.querySelectorAll("#shell *")].filter((node) => {
    const box = node.getBoundingClientRect();
    return box.width > 0 && (box.right > innerWidth + 1 || box.left < -1); })
  .map((node) => node.outerHTML.slice(0, 80))"""


def boxes(page: Seen) -> dict[str, dict[str, float]]:
    return {name: page.there(name).bounding_box() for name in FIXED}


def test_nothing_moves_while_alarms_and_orders_come(stage: Any) -> None:
    page = stage.open()
    page.page.wait_for_timeout(500)
    before = boxes(page)
    for number in range(10):
        stage.flight.event(Severity.ERROR, f"trouble {number} that takes some words to tell", f"drone_{1 + number % 2}")
    stage.flight.battery["drone_1"] = 0.03
    stage.flight.frozen = True
    page.there("hold").click()
    page.there("drone_2-land").click()
    page.there("banner-tracker").wait_for(timeout=20_000)
    page.wait(lambda s: len(s["orders"]) == 2)
    page.page.wait_for_timeout(700)
    assert boxes(page) == before
    page.there("more-alarms").click()
    assert page.page.locator(".banner:visible").count() > 1
    assert boxes(page) == before
    page.shot("alarms_open")


@pytest.mark.parametrize("size", [(1440, 900), (2560, 1440), (1024, 768), (390, 844)])
def test_nothing_is_cut_off(stage: Any, size: tuple[int, int]) -> None:
    page = stage.open()
    page.page.set_viewport_size({"width": size[0], "height": size[1]})
    stage.flight.battery["drone_1"] = 0.17
    stage.flight.link["drone_1"] = 0.08
    stage.flight.modes["drone_2"] = "TAKING_OFF"
    page.there("hold").click()
    page.wait(lambda s: s["orders"])
    page.page.wait_for_timeout(800)
    assert page.page.evaluate(CUT_OFF) == []
    assert page.page.evaluate(OUTSIDE) == []
    assert page.page.evaluate("() => document.documentElement.scrollWidth") <= size[0]
    stage.flight.battery = {"drone_1": 0.9, "drone_2": None}
    page.wait(lambda s: page.there("worst-battery").inner_text() == "unknown drone_2")
    assert page.there("battery-lasts").inner_text() == "others ≥ 90 %"
    assert page.page.evaluate(CUT_OFF) == []
    page.shot(f"layout_{size[0]}")


@pytest.mark.exhaustive
def test_the_bar_says_how_long_the_worst_battery_lasts(stage: Any) -> None:
    """Half a minute must pass before a drain is believed."""
    page = stage.open()
    stage.flight.battery = {"drone_1": 0.9, "drone_2": 0.6}
    page.wait(lambda s: page.there("worst-battery").inner_text() == "60 % drone_2")
    assert page.there("battery-lasts").inner_text() == "lands in ~5 min"
    page.page.wait_for_timeout(31_000)
    stage.flight.battery["drone_2"] = 0.5
    page.wait(lambda s: page.there("battery-lasts").inner_text() == "lands in 1 min")
    stage.flight.battery["drone_1"] = 0.52  # it spends more: 37 points are left of 75
    page.wait(lambda s: page.there("battery-lasts").inner_text() == "another: < 1 min")
    assert page.there("worst-battery").inner_text() == "50 % drone_2"
    stage.flight.modes["drone_2"] = "LANDED"
    page.wait(lambda s: "flies ~4 min" in page.there("card-drone_2").inner_text())
    assert "lands in < 1 min" in page.there("card-drone_1").inner_text()


def test_the_bar_says_what_the_team_does(stage: Any) -> None:
    page = stage.open()
    page.wait(lambda s: page.there("team-mode").inner_text() == "TRACK")
    page.wait(lambda s: page.there("worst-battery").inner_text() == "34 % drone_2")
    page.wait(lambda s: page.there("recording").inner_text() == "on")
    assert page.there("air-time").inner_text().startswith("0:")
    stage.flight.modes["drone_1"] = "LANDING"
    page.wait(lambda s: page.there("team-mode").inner_text() == "LANDING")
    assert page.there("team-who").inner_text() == "drone_1"
    stage.flight.modes = {"drone_1": "LANDED", "drone_2": "LANDED"}
    page.wait(lambda s: page.there("team-mode").inner_text() == "ON GROUND")
    stage.flight.battery["drone_1"] = None
    page.wait(lambda s: page.there("worst-battery").inner_text() == "unknown drone_1")


def test_one_sentence_says_what_the_team_does_and_what_may_be_done(stage: Any) -> None:
    page = stage.open()
    verdict = page.there("verdict")
    stage.flight.battery["drone_2"] = 0.6
    page.wait(lambda s: verdict.inner_text() == "drone_1 and drone_2 track the target. Nobody is lost.")
    assert page.there("banner-none").inner_text() == "✓ No alarms"
    stage.flight.modes = {"drone_1": "HOLD", "drone_2": "TRACK"}
    said = "drone_2 tracks the target; drone_1 holds. Nobody is lost. RESUME lets them go on."
    page.wait(lambda s: verdict.inner_text() == said)
    stage.flight.battery["drone_2"] = 0.28
    low = "CAUTION: The battery of drone_2 is low: 28 %, lands in ~1 min"
    page.wait(lambda s: page.there("banner-concern").inner_text() == low)
    stage.flight.battery["drone_2"] = 0.6
    stage.flight.unseen_s[TARGET] = 2.0
    page.wait(lambda s: "Not seen: turtlebot for 2 s." in verdict.inner_text())
    page.shot("verdict")
    stage.flight.modes = {"drone_1": "LANDED", "drone_2": "LANDED"}
    page.wait(lambda s: verdict.inner_text() == "Nobody flies. TAKE OFF flies again.")


def test_each_drone_says_what_it_does_and_why(stage: Any) -> None:
    page = stage.open()
    duty = page.there("drone_1-duty")
    page.wait(lambda s: duty.inner_text().startswith("Watches turtlebot"))
    assert "drone_1 is located by ceiling" in duty.inner_text()
    assert "limited by the fence" in page.there("drone_2-duty").inner_text()
    stage.flight.detail["drone_1"] = "hovers: no telemetry from the vehicle"
    stage.flight.lands_in_s["drone_1"] = 1.8
    stage.flight.braked.add("drone_1")
    page.wait(lambda s: duty.inner_text() == "Hovers: no telemetry from the vehicle.")
    page.wait(lambda s: "drone_1 lands in 2 s: hovers: no telemetry" in page.there("banner-alarm").inner_text())
    assert page.there("drone_1-mode").inner_text() == "lands in 2 s"
    assert page.there("hold").inner_text() == "HOLD 1\ndrone_1 lands anyway"
    stage.flight.detail.clear()
    stage.flight.lands_in_s.clear()
    stage.flight.braked.clear()
    stage.flight.modes["drone_1"] = "HOLD"
    page.wait(lambda s: duty.inner_text() == "Held by operator.")
    assert page.there("hold").inner_text().startswith("HOLD 2")
    stage.flight.modes = {"drone_1": "LANDED", "drone_2": "LANDED"}
    page.wait(lambda s: page.there("hold").inner_text() == "HOLD\nnobody flies")
    assert page.there("take-off").inner_text().startswith("TAKE OFF 2")


# What stands in the place of alarms, below it, on HOLD, and on the cards of both drones.
TOLD = {
    "all_is_well": ("No alarms", "track the target. Nobody is lost.", "hover in place", "track", "track"),
    "one_lands_for_its_battery": ("battery 13%", "drone_2 lands.", "drone_2 lands anyway", "track", "landing"),
    "all_are_held": ("No alarms", "RESUME lets them go on.", "hold already", "hold", "hold"),
    "one_is_unseen_and_will_land": (
        "lands in 6 s",
        "Not seen: drone_1",
        "drone_1 lands anyway",
        "lands in 6 s",
        "track",
    ),
    "the_tracker_is_silent": ("TRACKER SILENT", "Who is lost is not", "lands anyway", "lands in 1 s", "lands in 1 s"),
    "one_has_a_stuck_sensor": ("stuck at 0.27 m/s", "drone_2 hovers. Nobody", "hover in place", "track", "hover"),
    "all_land": ("No alarms", "drone_1 and drone_2 land.", "lands anyway", "landing", "landing"),
    "one_has_a_weak_link": ("weak link, 31%", "Nobody is lost.", "hover in place", "track", "track"),
    "one_stands_with_an_unknown_battery": ("battery 19%", "drone_2 stands.", "hover in place", "track", "landed"),
    "the_target_is_lost": ("turtlebot: not seen for 7 s", "look for the target", "hover in place", "search", "search"),
}


def test_every_situation_is_told_in_one_way_and_fits(stage: Any) -> None:
    page = stage.open()
    places = [page.there(name) for name in ("banners", "verdict", "hold", "drone_1-mode", "drone_2-mode")]

    def told(name: str) -> bool:
        return all(words in place.inner_text() for words, place in zip(TOLD[name], places, strict=True))

    for name, arrange in SITUATIONS.items():
        SITUATIONS["all_is_well"](stage.flight)
        page.page.wait_for_timeout(300)  # until the page has it
        arrange(stage.flight)
        page.wait(lambda s, name=name: told(name))
        page.page.wait_for_timeout(700)  # until what was seen in the situation before counts no more
        assert page.page.evaluate(CUT_OFF) == [], name
        page.shot(f"situation_{name}")


def test_only_starts_that_would_be_accepted_are_offered(stage: Any) -> None:
    page = stage.open()
    page.wait(lambda s: page.there("take-off").get_attribute("title") == "nobody on the floor")
    assert page.there("take-off").is_disabled() and page.there("drone_1-takeoff").is_disabled()
    assert page.there("track").get_attribute("title") == "under way"
    stage.flight.modes = {"drone_1": "LANDED", "drone_2": "HOLD"}
    page.wait(lambda s: page.there("drone_1-takeoff").is_enabled())
    assert page.there("resume").is_enabled() and page.there("drone_2-takeoff").is_disabled()
    assert page.there("track").inner_text() == "TRACK\npress RESUME"
    page.there("drone_1-takeoff").click()
    page.wait(lambda s: [command.scope for command in stage.flight.commands] == [("operator", "drone_1")])
    stage.flight.frozen = True
    page.wait(lambda s: page.there("resume").get_attribute("title") == "tracker silent")
    assert page.there("track").is_disabled()


def test_the_wall_is_read_from_three_metres(stage: Any) -> None:
    page = stage.open()
    page.page.set_viewport_size({"width": 1920, "height": 1080})
    page.page.keyboard.press("w")
    page.page.wait_for_timeout(500)
    sizes = page.page.evaluate(
        """() => ["#team-mode", "#worst-battery", "[data-testid=drone_1-battery]", "[data-testid=drone_1-seen]"]
             .map((of) => parseFloat(getComputedStyle(document.querySelector(of)).fontSize))"""
    )
    assert min(sizes) >= 45
    assert page.page.evaluate(OUTSIDE) == []
    page.shot("wall")
