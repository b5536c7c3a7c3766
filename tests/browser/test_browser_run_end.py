"""The page after the end of a run, and its reuse for the next run."""

import json
import time
from pathlib import Path
from typing import Any

import pytest
from seen_page import Seen, eventually

from groundstation.appearance.colours import ROBOT_COLOURS
from groundstation.bus.messages import RUN, Severity
from groundstation.report import run_facts
from groundstation.report.file_names import HTML_NAME, JSON_NAME
from groundstation.report.page.chart import Chart, Curve
from groundstation.report.page.document import holders, page

pytestmark = [pytest.mark.browser, pytest.mark.slow]


def end_run(stage: Any, severity: Severity, how: str) -> None:
    """End the run as the main process does: a message on the bus, and a signal to each process."""
    stage.console.terminate()  # the message is often slower than the signal
    stage.flight.event(severity, f"run ended: {how}", RUN)
    stage.console.wait(10)


def ended_page(stage: Any, severity: Severity, how: str) -> Seen:
    page: Seen = stage.open()
    end_run(stage, severity, how)
    page.wait(lambda s: not s["connected"])
    page.page.wait_for_timeout(1500)  # for all messages that it might send after a lost connection
    return page


def announced(stage: Any, how: str) -> tuple[Seen, Any]:
    """Return a page whose console lives on after the end was announced, and the strip that shows it."""
    page: Seen = stage.open()
    stage.flight.event(Severity.WARNING, f"run ended: {how}", RUN)
    strip = page.there("banner-ended")
    strip.wait_for(timeout=20_000)
    return page, strip


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
    page.page.wait_for_timeout(3000)  # no process sends heartbeats any more, and none needs to
    assert page.there("recording").inner_text() == "ended"
    assert page.there("worst-age").inner_text() == "–"
    assert page.there("turtlebot-duty").inner_text() == "The run is over."
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
    page, strip = announced(stage, "not every drone reported a landing")
    assert page.there("safety").inner_text() == "ACT"
    assert "grave" in strip.get_attribute("class")
    stage.flight.event(Severity.ERROR, "drone_1 LANDING: nothing heard of the supervisor", "drone_1")
    alarms = page.page.locator("[data-testid=banner-alarm]")  # an operator gives stops because of these
    eventually(lambda: any("drone_1 LANDING" in text for text in alarms.all_text_contents()), what="the alarm stays")
    assert all(stop.is_enabled() for stop in stops(page))  # while there is a recipient
    stage.console.terminate()
    stage.console.wait(10)
    eventually(lambda: all(stop.is_disabled() for stop in stops(page)), what="the stops are off")
    assert "groundstation land" in strip.inner_text()
    page.shot("run_ended_without_landing")


def test_an_end_that_does_not_know_whether_all_are_down_is_not_called_safe(stage: Any) -> None:
    page, strip = announced(stage, "stopped by the operator; not every drone was heard")
    assert page.there("safety").inner_text() == "WATCH"
    assert "groundstation land" in strip.inner_text() and "mild" in strip.get_attribute("class")
    assert all(stop.is_enabled() for stop in stops(page))


def test_a_fault_that_ends_the_run_asks_for_nothing_once_all_have_landed(stage: Any) -> None:
    page = ended_page(stage, Severity.ERROR, "tracker died; all drones are on the ground")
    strip = page.there("banner-ended")
    assert "mild" in strip.get_attribute("class")
    assert "tracker died" in strip.inner_text() and "groundstation land" not in strip.inner_text()
    assert page.there("safety").inner_text() == "WATCH"
    assert page.there("safety-means").inner_text() == "a problem, but\nno need to act"


def test_a_console_that_dies_is_no_end_of_the_run(stage: Any) -> None:
    page: Seen = stage.open()
    stage.console.terminate()
    stage.console.wait(10)
    page.there("banner-link").wait_for(timeout=20_000)
    assert "NO CONNECTION" in page.there("banner-link").inner_text()
    assert "no connection" in page.there("hold").inner_text()
    assert "groundstation land" in page.there("banner-link").inner_text()
    assert all(stop.is_enabled() for stop in stops(page))


def judged_run(folder: Path) -> None:
    """Write the files of a failed run, as the command does."""
    folder.mkdir(exist_ok=True)
    run_facts.write(folder, run_facts.RunFacts(command="groundstation demo --duration 15"))
    judged = {"verdict": "failed", "reasons": ["target error (rms) 0.3 m, asked for at most 0.2 m"]}
    (folder / JSON_NAME).write_text(json.dumps(judged))
    chart = Chart("Error", "m", "", [0.0, 1.0, 2.0], [Curve("error", ROBOT_COLOURS[0], [0.1, 0.2, 0.3])])
    room = '<svg viewBox="0 0 9 9"><rect id="wall" width="9" height="9" fill="#ff0000"/></svg>'
    (folder / HTML_NAME).write_text(page("the run", "", [("Room", room), ("Flight", holders([chart], 0))], [chart]))


def test_the_page_tells_what_the_run_came_to_long_after_the_console_has_gone(stage: Any, tmp_path: Path) -> None:
    stage.console.terminate()
    stage.console.wait(10)
    stage.start_console(run=str(tmp_path))
    seen: Seen = stage.open()
    judged_run(tmp_path)
    began = time.monotonic()
    end_run(stage, Severity.INFO, "all drones are on the ground")
    assert time.monotonic() - began < 6.0, "the console goes once the page has what it shows"
    seen.wait(lambda s: not s["connected"])
    seen.page.wait_for_timeout(1500)
    strip = seen.there("banner-ended")
    assert "FAILED" in strip.inner_text() and "calm" in strip.get_attribute("class")
    assert "FAILED" in seen.there("result").inner_text()
    assert "asked for at most 0.2 m" in seen.there("reasons").inner_text()
    assert seen.there("fly-again").inner_text() == "groundstation demo --duration 15"
    assert str(tmp_path) in seen.there("ending").inner_text()
    seen.shot("run_judged")
    with seen.page.context.expect_page() as opened:
        seen.there("report-link").click()
    report = opened.value
    report.wait_for_selector(".uplot")  # its script ran
    assert report.locator("h1").inner_text() == "the run"
    assert report.evaluate("() => getComputedStyle(document.querySelector('#wall')).fill") == "rgb(255, 0, 0)"
    assert report.evaluate("() => getComputedStyle(document.querySelector('section')).borderRadius") == "10px"

    stage.start_console(run="run-2")
    seen.wait(lambda s: s["connected"] and s["run"] != "")
    seen.there("ending").wait_for(state="hidden", timeout=5000)
