"""Past alarms: the log behind the alarm strip opens by keyboard, and opening it moves nothing."""

import re
import signal
from typing import Any

import pytest
from accessibility import violations
from clipping import clipped
from places import boxes, moved
from situations import SITUATIONS

from groundstation.bus import messages as m
from groundstation.bus import topics as t

pytestmark = [pytest.mark.browser, pytest.mark.slow]


def weak_links(state: dict[str, Any]) -> list[str]:
    """Return the texts of the past alarms that these tests raise; a busy machine may add others."""
    return [past["text"] for past in state["sections"]["past_alarms"] if "weak link" in past["text"]]


def counted(button: Any) -> int:
    """Return the number of past alarms on the button; it shows none for 0."""
    return int(str(button.inner_text()).removeprefix("Past alarms") or 0)


def in_focus(page: Any) -> str:
    return str(page.page.evaluate("() => document.activeElement.id"))


def test_past_alarms_are_read_behind_the_strip_by_keyboard(stage: Any) -> None:
    SITUATIONS["all_is_well"](stage.flight)
    page = stage.open()
    button, log = page.there("past-alarms"), page.there("alarm-log")
    page.wait(lambda s: page.there("banner-none").is_visible() and button.inner_text().startswith("Past alarms"))
    before = boxes(page)
    stage.flight.link["drone_1"] = 0.08
    page.wait(lambda s: "weak link, 8%" in page.there("banners").inner_text())
    assert weak_links(page.state()) == []  # it lasts
    stage.flight.link.clear()
    page.wait(weak_links)
    # At least: the page adds alarms that only it noticed.
    page.wait(lambda s: counted(button) >= len(s["sections"]["past_alarms"]) > 0)
    button.focus()
    page.page.keyboard.press("Enter")
    clock = r"\d\d:\d\d:\d\d"
    assert re.search(rf"{clock} – {clock}, \d+ s\s+ACT\s+drone_1: weak link, 8% arrives", log.inner_text())
    assert in_focus(page) == "alarm-log" and button.get_attribute("aria-expanded") == "true"
    assert "Alarms that are over" in log.get_attribute("aria-label")
    assert moved(page, before) == {} and clipped(page.page) == []
    assert violations(page.page) == []
    page.shot("past_alarms")
    page.page.keyboard.press("Escape")
    assert log.is_hidden() and in_focus(page) == "log"
    page.page.keyboard.press("a")
    assert log.is_visible()
    page.page.keyboard.press("a")
    assert log.is_hidden() and moved(page, before) == {}


def test_past_alarms_outlive_a_reload_and_give_way_to_those_that_last(stage: Any) -> None:
    SITUATIONS["all_is_well"](stage.flight)
    page = stage.open()
    stage.flight.link["drone_1"] = 0.08
    page.wait(lambda s: "weak link, 8%" in page.there("banners").inner_text())
    stage.flight.link.clear()
    page.wait(weak_links)
    page.page.reload()
    page.wait(lambda s: s["frames"] > 2 and weak_links(s))
    page.there("past-alarms").click()
    stage.flight.link, stage.flight.battery["drone_2"] = (
        {"drone_1": 0.08},
        0.28,
    )  # with the same advice they share a line
    page.wait(lambda s: page.there("more-alarms").is_visible())
    page.there("more-alarms").click()
    assert page.there("alarm-log").is_hidden() and page.page.locator(".banner:visible").count() >= 2


def test_a_suspected_figure_stands_with_its_time_until_it_is_withdrawn(stage: Any) -> None:
    SITUATIONS["all_is_well"](stage.flight)
    page = stage.open()
    page.wait(lambda s: page.there("banner-none").is_visible())
    before, bus = boxes(page), stage.flight.bus("diagnosis")
    words = "the pictures of drone_1's camera are 42 +- 9 ms newer than configured"
    words += " or drone_1's telemetry is 46 +- 11 ms older than its stamps say"
    figure = m.SuspectedFigure("drone_1", words, "check the clock of drone_1", bus.header("diagnosis").stamp_ns)
    bus.publish(t.SUSPICION, m.Suspicion(header=bus.header("diagnosis"), cause=words, figures=(figure,)))
    page.wait(lambda s: "Suspected" in page.there("banners").inner_text())
    told = page.there("banner-alarm").inner_text()
    assert re.search(rf"Suspected: {re.escape(words)} \(told at \d\d:\d\d:\d\d\)", told)
    assert "When all have landed: check the clock of drone_1." in told
    assert page.there("safety").inner_text() == "WATCH" and moved(page, before) == {} and clipped(page.page) == []
    page.page.set_viewport_size({"width": 390, "height": 844})
    fits = "(one) => one.scrollWidth <= one.clientWidth"
    page.wait(lambda _: page.there("more-alarms").is_visible())
    assert page.there("safety").evaluate(fits)
    page.there("more-alarms").click()
    behind = "(one) => getComputedStyle(one).backgroundColor"
    assert page.there("verdict").evaluate(behind) != "rgba(0, 0, 0, 0)", "it lies over a card"
    page.there("more-alarms").click()
    page.page.set_viewport_size({"width": 1440, "height": 900})
    page.page.wait_for_timeout(9000)  # longer than an event is shown
    assert page.there("banner-alarm").inner_text() == told
    bus.publish(t.SUSPICION, m.Suspicion(header=bus.header("diagnosis"), cause=""))
    page.wait(lambda s: any(words in past["text"] for past in s["sections"]["past_alarms"]))
    page.wait(lambda s: "Suspected" not in page.there("banners").inner_text())


def test_alarms_raised_by_the_page_itself_are_logged_too(stage: Any) -> None:
    SITUATIONS["all_is_well"](stage.flight)
    page = stage.open()
    stage.console.send_signal(signal.SIGSTOP)
    try:
        page.there("banner-silent").wait_for(timeout=20_000)
        assert page.there("safety").inner_text() == "ACT"
    finally:
        stage.console.send_signal(signal.SIGCONT)
    page.wait(lambda s: page.there("banner-silent").count() == 0)
    page.there("past-alarms").click()
    log = page.there("alarm-log")
    page.wait(lambda s: re.search(r"ACT\s+CONSOLE SILENT for \d", log.inner_text()))
    page.page.reload()
    page.wait(lambda s: s["frames"] > 2)
    page.there("past-alarms").click()
    page.wait(lambda s: re.search(r"ACT\s+CONSOLE SILENT for \d", log.inner_text()))
