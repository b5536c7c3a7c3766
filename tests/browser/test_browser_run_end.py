"""What the page says when a run has ended, and that it is the next run's page afterwards."""

from typing import Any

import pytest
from seen_page import Seen, eventually

from groundstation.bus.messages import RUN, Severity

pytestmark = [pytest.mark.browser, pytest.mark.slow]


def end_run(stage: Any, severity: Severity, how: str) -> None:
    """End the run as the main process does: a word on the bus, and a signal to each process."""
    stage.console.terminate()  # the word is often slower than the signal
    stage.flight.event(severity, f"run ended: {how}", RUN)
    stage.console.wait(10)


def ended_page(stage: Any, severity: Severity, how: str) -> Seen:
    page: Seen = stage.open()
    end_run(stage, severity, how)
    page.wait(lambda s: not s["connected"])
    page.page.wait_for_timeout(1500)  # for all that it might say after a loss of its connection
    return page


def stops(page: Seen) -> list[Any]:
    return [page.there(name) for name in ("land-all", "hold", "cut-motors", "drone_1-land")]


def test_a_normal_end_is_calm_and_leaves_nothing_to_stop(stage: Any) -> None:
    page = ended_page(stage, Severity.INFO, "all drones are on the ground")
    strip = page.there("banner-ended")
    assert (
        "Run ended: all drones are on the ground" in strip.inner_text() and "stop buttons are off" in strip.inner_text()
    )
    assert "calm" in strip.get_attribute("class")
    assert page.page.locator(".banner").count() == 1  # no NO CONNECTION, no TRACKER SILENT, no alarm
    assert page.there("link").inner_text() == "run ended"
    assert all(stop.is_disabled() and "the run has ended" in stop.get_attribute("title") for stop in stops(page))
    page.page.wait_for_timeout(3000)  # nobody beats any more, and nobody needs to
    assert page.there("recording").inner_text() == "ended"
    assert page.there("worst-age").inner_text() == "–"
    assert {pill.get_attribute("data-level") for pill in page.page.locator("#processes .pill:not(.plain)").all()} == {
        "wait"
    }
    page.page.keyboard.press("l")
    assert "the run has ended" in page.there("orders").inner_text()
    page.shot("run_ended")

    stage.start_console(run="run-2")
    page.wait(lambda s: s["connected"] and s["seeds"] == 2)
    page.there("banner-ended").wait_for(state="detached", timeout=5000)
    assert all(stop.is_enabled() for stop in stops(page))
    assert page.there("hold").get_attribute("title") == "Hover where they are (H)"
    page.page.wait_for_timeout(1500)
    assert stage.flight.commands == []


def test_an_end_without_a_landing_is_grave(stage: Any) -> None:
    page: Seen = stage.open()
    stage.flight.event(Severity.WARNING, "run ended: not every drone reported a landing", RUN)
    strip = page.there("banner-ended")
    strip.wait_for(timeout=20_000)
    assert "grave" in strip.get_attribute("class")
    assert all(stop.is_enabled() for stop in stops(page))  # for as long as there is somebody to take them
    stage.console.terminate()
    stage.console.wait(10)
    eventually(lambda: all(stop.is_disabled() for stop in stops(page)), what="the stops are off")
    assert "groundstation land" in strip.inner_text()
    page.shot("run_ended_without_landing")


def test_a_console_that_dies_is_no_end_of_the_run(stage: Any) -> None:
    page: Seen = stage.open()
    stage.console.terminate()
    stage.console.wait(10)
    page.there("banner-link").wait_for(timeout=20_000)
    assert "NO CONNECTION" in page.there("banner-link").inner_text()
    assert "no connection" in page.there("hold").inner_text()
    assert "groundstation land" in page.there("banner-link").inner_text()
    assert all(stop.is_enabled() for stop in stops(page))
