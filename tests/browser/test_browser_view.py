"""The page's display of the flight, and its warnings when the display is out of date."""

import itertools
import math
import os
import signal
import time
from typing import Any
from urllib.parse import urlsplit

import pytest
from clipping import clipped
from fake_flight import DRONES, FakeFlight
from on_demand import on_demand


def slowness() -> float:
    """Return the slowdown of this process by others on its core: 1 on an idle machine."""
    wall, used = time.monotonic(), time.thread_time()
    while time.thread_time() - used < 0.1:
        pass
    return max(1.0, (time.monotonic() - wall) / 0.1)


def assert_told_in_time(page: Any, kind: str) -> None:
    """Require a warning within 1.5 s by the page's clock, plus the time in which the browser did not let it draw."""
    mark = page.state()["marks"][kind]
    assert mark["afterS"] < 1.5 + mark["gapS"]


def becomes(page: Any, testid: str, attribute: str, value: str) -> str:
    """Return the attribute as soon as it has this value, or after 15 s."""
    deadline = time.monotonic() + 15.0
    while (now := page.there(testid).get_attribute(attribute) or "") != value and time.monotonic() < deadline:
        page.page.wait_for_timeout(100)
    return now


pytestmark = [pytest.mark.browser, pytest.mark.slow]

HIDDEN = """() => [...document.querySelectorAll(".crew, #commands")]
  .filter((one) => one.scrollHeight > one.clientHeight + 1)
  .map((one) => `${one.getAttribute("aria-label")}: ${one.scrollHeight} of ${one.clientHeight} px`)"""


def test_first_frame_comes_soon_and_nothing_leaves_loopback(stage: Any) -> None:
    page = stage.open()
    state = page.wait(lambda s: s["draws"] > 20 and s["pictures"]["marks"] > 0)
    assert state["marks"]["firstMs"] < 5000.0 * slowness()
    assert set(state["ellipses"]) == {"drone_1", "drone_2", "turtlebot"}
    assert state["trail"]["turtlebot"] > 0
    page.page.wait_for_timeout(1500)
    page.shot("light")
    assert {urlsplit(url).hostname for url in page.requests if not url.startswith("blob:")} == {"127.0.0.1"}
    assert not page.troubles, page.troubles


def test_words_of_a_crowded_map_give_way_to_each_other(mixed_stage: Any) -> None:
    mixed_stage.flight.distance_m = 0.3
    page, names = mixed_stage.open(), {*mixed_stage.flight.drones, "turtlebot"}
    for _ in range(5):
        labels = page.wait(lambda s: {label["words"].split()[0] for label in s["labels"]} >= names)["labels"]
        for one, other in itertools.combinations(labels, 2):
            beside = one["right"] <= other["left"] or other["right"] <= one["left"]
            assert beside or one["bottom"] <= other["top"] or other["bottom"] <= one["top"], (one, other)
        page.page.wait_for_timeout(400)
    page.shot("crowded")


def test_ellipses_are_to_scale(stage: Any) -> None:
    page = stage.open()
    state = page.state()
    # The fake drone's covariance is [[a, b], [b, 0.003]] with a in 0.002..0.006, |b| = 0.0015.
    drawn = state["ellipses"]["drone_1"]
    factor = math.sqrt(-2 * math.log(0.05))
    assert 0.05 * factor < drawn["major"] < 0.082 * factor
    assert drawn["minor"] < drawn["major"]
    x, y = state["points"]["drone_1"]
    there = state["at"]["drone_1"]
    centre = page.page.get_by_test_id("map").bounding_box()
    assert math.isclose(x - centre["width"] / 2, there[0] * state["scale"], abs_tol=2.0)
    assert math.isclose(centre["height"] / 2 - y, there[1] * state["scale"], abs_tol=2.0)


def test_canvas_is_painted_and_dark_differs_from_light(stage: Any) -> None:
    light, dark = stage.open(color_scheme="light"), stage.open(color_scheme="dark")
    script = """() => {
      const c = document.getElementById("map");
      const d = c.getContext("2d").getImageData(0, 0, c.width, c.height).data;
      const seen = new Set();
      let sum = 0;
      for (let i = 0; i < d.length; i += 4004) {
        seen.add(`${d[i]},${d[i + 1]},${d[i + 2]}`);
        sum += d[i] + d[i + 1] + d[i + 2];
      }
      return [seen.size, sum];
    }"""
    (colours, bright), (dark_colours, dim) = light.page.evaluate(script), dark.page.evaluate(script)
    assert colours > 5 and dark_colours > 5
    assert bright > 2 * dim
    dark.page.wait_for_timeout(1000)
    dark.shot("dark")
    assert not light.troubles + dark.troubles


def test_phone_and_keyboard(stage: Any) -> None:
    stage.flight.modes["drone_1"] = "LANDED"  # or there would be nothing to take off
    page = stage.open()
    page.page.set_viewport_size({"width": 390, "height": 844})
    page.page.wait_for_timeout(800)
    assert page.page.evaluate("() => document.documentElement.scrollWidth") <= 390
    land = page.there("land-all").bounding_box()
    assert land["y"] + land["height"] <= 844 and land["height"] >= 44
    page.shot("phone")
    page.page.keyboard.press("Tab")
    reached = []
    for _ in range(30):
        reached.append(page.page.evaluate("() => document.activeElement.dataset.testid ?? ''"))
        page.page.keyboard.press("Tab")
    assert {"hold", "land-all", "map", "take-off", "cut-motors", "drone_1-land"} <= set(reached)
    unnamed = page.page.evaluate(
        """() => [...document.querySelectorAll("button")].filter((b) => !b.textContent.trim() && !b.ariaLabel).length"""
    )
    assert unnamed == 0
    assert "certified emergency stop" in page.page.inner_text("#commands")


def test_frozen_tracker_is_shown_as_stale(stage: Any) -> None:
    page = stage.open()
    stage.flight.frozen = True
    page.there("banner-tracker").wait_for(timeout=20_000)
    assert_told_in_time(page, "tracker")
    assert "TRACKER SILENT" in page.there("banner-tracker").inner_text()
    page.page.wait_for_timeout(1500)
    assert "stale" in (page.there("card-turtlebot").get_attribute("class") or "")
    page.shot("stale")
    stage.flight.frozen = False
    page.there("banner-tracker").wait_for(state="detached", timeout=5000)


def test_frozen_console_is_shown(stage: Any) -> None:
    page = stage.open()
    os.kill(stage.console.pid, signal.SIGSTOP)
    try:
        page.there("banner-silent").wait_for(timeout=20_000)
        assert_told_in_time(page, "silent")
        page.there("land-all").click()
        page.page.wait_for_timeout(300)
        assert "NOT CONFIRMED" in page.there("orders").inner_text()
        page.shot("console_frozen")
    finally:
        os.kill(stage.console.pid, signal.SIGCONT)
    page.wait(lambda s: any(order["state"] == "confirmed" for order in s["orders"]))
    assert [command.verb for command in stage.flight.commands] == ["LAND"]


def test_killed_console_comes_back_with_everything(stage: Any) -> None:
    page = stage.open()
    before = page.state()
    stage.console.kill()
    stage.console.wait(5)
    page.there("banner-link").wait_for(timeout=20_000)
    page.shot("console_killed")
    stage.start_console()
    after = page.wait(lambda s: s["connected"] and s["seeds"] == 2 and s["trusted"] and s["frames"] > before["frames"])
    assert after["run"] == before["run"]
    page.wait(lambda s: set(s["ellipses"]) == set(before["ellipses"]))  # as soon as the tracker sends again


def test_battery_colours_at_their_thresholds(stage: Any) -> None:
    page = stage.open()
    levels = {}
    for value, level in ((0.82, "good"), (0.29, "low"), (0.18, "empty")):
        stage.flight.battery["drone_1"] = value
        levels[level] = becomes(page, "drone_1-battery", "data-battery", level)
    assert all(level == shown for level, shown in levels.items()), levels
    assert page.there("drone_1-battery").inner_text() == "18 % low"
    stage.flight.modes["drone_1"] = "LANDED"
    page.wait(lambda s: "charge!" in page.there("drone_1-battery").inner_text())


@pytest.mark.parametrize("width", [*on_demand([1440, 1180]), 950, 390])
def test_alarms_on_the_cards_are_never_cut_off(stage: Any, width: int) -> None:
    page = stage.open()
    page.page.set_viewport_size({"width": width, "height": 900})
    stage.flight.battery["drone_1"] = 0.17
    stage.flight.link["drone_1"] = 0.08
    assert becomes(page, "drone_1-battery", "data-battery", "empty") == "empty"
    assert becomes(page, "drone_1-link", "data-link", "empty") == "empty"
    assert clipped(page.page) == []
    page.there("card-drone_1").screenshot(path=str(page.shots() / f"alarms_{width}.png"))


def test_link_telemetry_and_age_colours_at_their_thresholds(stage: Any) -> None:
    page = stage.open()
    for value, level, words in (
        (0.93, "full", "93 %"),
        (0.59, "low", "weak"),
        (0.29, "empty", "bad!"),
        (None, "unknown", "?"),
    ):
        stage.flight.link["drone_1"] = value
        assert becomes(page, "drone_1-link", "data-link", level) == level
        assert words in page.there("drone_1-link").inner_text()
    for rate_hz, level in ((9.0, "low"), (0.5, "empty"), (50.0, "")):
        stage.flight.rate_hz["drone_1"] = rate_hz
        assert becomes(page, "drone_1-rate", "class", level) == level
    stage.flight.drones = ("drone_2",)
    assert becomes(page, "drone_1-heard", "class", "low") == "low"
    assert "stale" in (page.there("card-drone_1").get_attribute("class") or "")
    page.wait(lambda s: page.there("drone_1-mode").inner_text() == "silent")
    page.wait(lambda s: page.there("team-mode").inner_text() == "NOT HEARD")
    opacity = "(node) => [...node.children].map((child) => getComputedStyle(child).opacity)"
    assert set(page.there("card-drone_1").evaluate(opacity)) == {"0.55", "1"}, "its stops go out all the same"
    assert becomes(page, "drone_1-heard", "class", "empty") == "empty"
    assert "stale" not in (page.there("card-drone_2").get_attribute("class") or "")


def test_words_in_a_picture_stand_off_rings_and_other_words(stage: Any) -> None:
    """Two rings in a picture with little room: left of, right of or below each is no place for the second's words."""
    place = """async ([ring, written, rings]) => {
        const { placeFor } = await import("/js/cameras.js");
        return placeFor(ring, 150, [256, 142], written, rings);
    }"""
    page, upper, lower = stage.open(), [102, 50, 12], [170, 110, 18]
    x, y = page.page.evaluate(place, [lower, [], [upper, lower]])
    assert (x, y) == (95, 92), "above its ring: there is no room below"
    assert page.page.evaluate(place, [upper, [[x, y, 150]], [upper, lower]]) == [27, 38]
    assert page.page.evaluate(place, [[20, 70, 12], [], [[20, 70, 12]]]) == [32, 75], "right of it, where there is room"
    close_up = [128, 71, 200]
    assert page.page.evaluate(place, [close_up, [], [close_up]]) == [53, 76], "within a very wide ring"


def test_a_mixed_team_below_two_cameras(mixed_stage: Any) -> None:
    page = mixed_stage.open()
    state = page.wait(
        lambda s: s["pictures"]["marks"] > 0 and set(s["ellipses"]) == {*mixed_stage.flight.drones, "turtlebot"}
    )
    assert {camera["name"] for camera in state["scene"]["cameras"]} == set(mixed_stage.flight.cameras)
    for camera in (*mixed_stage.flight.cameras, "drone_1_camera", "drone_2_camera", "drone_3_camera"):
        page.there(f"camera-{camera}").scroll_into_view_if_needed()
        page.there(f"camera-{camera}").locator(".veil").wait_for(state="hidden")
    assert page.there("land-all").inner_text().endswith("all 3 land\nwhere they are")
    assert page.there("drone_3-battery").inner_text() == "unknown"
    page.shot("mixed_team")
    assert page.page.evaluate(HIDDEN) == [], "a low desk shows three drones, the target and the orders whole"
    page.there("drone_3-land").click()
    page.wait(lambda s: s["orders"] and s["orders"][0]["state"] == "confirmed")
    assert mixed_stage.flight.commands[0].scope == ("drone_3",)
    assert not page.troubles, page.troubles


def test_a_router_that_comes_back_brings_everything_back(stage: Any) -> None:
    page = stage.open()
    modes, endpoint = stage.flight.modes, stage.flight.endpoint
    stage.flight.stop()
    page.there("banner-tracker").wait_for(timeout=20_000)
    stage.flight = FakeFlight(endpoint=endpoint)
    stage.flight.start()
    page.there("banner-tracker").wait_for(state="detached", timeout=20_000)
    page.there("hold").click()
    page.wait(lambda s: s["orders"] and s["orders"][0]["state"] == "confirmed")
    assert set(page.state()["ellipses"]) >= set(modes)


def test_a_slow_viewer_slows_nobody(stage: Any) -> None:
    fast, slow = stage.open(), stage.open()
    dialogs: list[Any] = []
    slow.page.on("dialog", lambda dialog: dialogs.append(dialog))  # playwright marks the function
    slow.page.evaluate("() => { setTimeout(() => alert('nothing else runs in this page'), 0); }")
    before = fast.state()
    after = fast.wait(lambda s: s["nowMs"] - before["nowMs"] > 3000)
    # By the page's clock: 20 a second are sent, and a busy machine may lose half of them.
    assert after["frames"] - before["frames"] > 30
    dialogs[0].dismiss()
    caught_up = slow.wait(lambda s: s["connected"] and s["estimateAge"] < 2.0)
    assert caught_up["seeds"] == 1  # the server never disconnected it


def test_the_map_says_why_the_topology_is_as_it_is(stage: Any) -> None:
    page = stage.open()
    line = page.there("switch")
    page.wait(lambda s: line.is_visible())
    change = page.state()["sections"]["switch"]
    assert (
        change["reason"] == "the target's place should be known 15 % better this way"
    )  # the fake planner's: staying costs 1.18 times as much
    assert line.inner_text().startswith("Who watches whom changed ") and line.inner_text().endswith(
        f": {change['reason']}"
    )
    page.there("layer-graph").click()
    assert line.is_hidden()


def test_the_heights_fall_while_the_drones_land(stage: Any) -> None:
    """On the map's estimates and in the side view; so that a picture of a landing shows one."""
    page = stage.open()
    before = page.wait(lambda s: set(DRONES) <= set(s["at"]))["at"]
    stage.flight.modes = dict.fromkeys(DRONES, "LANDING")
    after = page.wait(lambda s: all(s["at"][name][2] < before[name][2] - 0.3 for name in DRONES))["at"]
    words = page.there("heights").get_attribute("aria-label")
    assert all(f"{name} {before[name][2]:.1f} m" not in words for name in DRONES), (words, after)
