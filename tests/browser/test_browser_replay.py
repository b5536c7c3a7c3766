"""Replay in the page: it ends with the picture of the live page, and its controls work."""

import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from conftest import Stage
from recorded_flight import Recorded, record
from seen_page import Seen, open_seen

pytestmark = [pytest.mark.browser, pytest.mark.slow]

# Messages of the fake flight's own processes; those of recorder and console go on after it.
_COMPARED = ("estimate", "setpoints", "truth", "vehicles", "plan", "cameras")


@pytest.fixture(scope="module")
def recorded(browser: Any, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Recorded]:
    stage = Stage(browser)
    try:
        yield record(stage.flight, stage.open(), tmp_path_factory.mktemp("recorded"), 5.0)
    finally:
        stage.close()


@pytest.fixture
def replay(browser: Any, recorded: Recorded, free_port: int) -> Iterator[Callable[..., Seen]]:
    """Start the command and open its page; a further call opens another page of the same replay."""
    contexts: list[Any] = []
    command = [sys.executable, "-m", "groundstation", "replay", str(recorded.folder), "--port", str(free_port)]
    process = subprocess.Popen([*command, "--paused"], stdout=subprocess.DEVNULL)
    yield lambda: open_seen(browser, contexts, f"http://127.0.0.1:{free_port}/")
    for context in contexts:
        context.close()
    process.terminate()
    process.wait(10)


def at_ms(state: dict[str, Any]) -> float:
    return float(state["playback"]["at_ms"])


def test_it_ends_with_the_picture_that_the_live_page_had(replay: Callable[..., Seen], recorded: Recorded) -> None:
    page = replay()
    page.page.keyboard.press("End")
    state = page.wait(lambda s: s["playback"]["ended"] and s["pictures"]["frames"] >= 3)
    live, then = recorded.live, state["sections"]
    for name in _COMPARED:
        assert then[name] == live["sections"][name], name
    # Messages from before the recorder's start are in no recording.
    events = [event["text"] for event in then["events"]]
    assert "a gust" in events and events == [event["text"] for event in live["sections"]["events"]][-len(events) :]
    (order,), (given,) = then["orders"], live["orders"]
    assert (order["verb"], order["state"], order["rows"]) == (given["verb"], given["state"], given["rows"])
    assert state["ellipses"] == live["ellipses"] and state["points"] == live["points"]
    for name, length in live["trail"].items():
        # The live page opened a little before the recorder did, and closed a little after.
        assert 0 < state["trail"][name] <= length + 3
    assert page.page.title().startswith("REPLAY")
    assert not page.troubles, page.troubles


def test_play_pause_step_and_speed(replay: Callable[..., Seen]) -> None:
    page = replay()
    began = at_ms(page.state())
    assert page.state()["playback"]["playing"] is False
    page.there("play").click()
    page.wait(lambda s: s["playback"]["playing"] and at_ms(s) > began + 500)
    page.page.locator("body").press("Space")
    stopped = at_ms(page.wait(lambda s: not s["playback"]["playing"]))
    page.page.wait_for_timeout(500)
    assert at_ms(page.state()) == stopped
    page.there("step-on").click()
    first = page.wait(lambda s: at_ms(s) > stopped)["sections"]["estimate"]["at"]
    page.page.keyboard.press(".")
    second = page.wait(lambda s: s["sections"]["estimate"]["at"] > first)["sections"]["estimate"]["at"]
    assert second - first < 200  # the fake tracker's tick is 20 ms, on a busy machine more
    page.page.keyboard.press(",")
    page.wait(lambda s: s["sections"]["estimate"]["at"] == first)
    page.there("speed").select_option("0.25")
    page.wait(lambda s: s["playback"]["speed"] == 0.25)
    page.page.locator("body").press(">")
    page.wait(lambda s: s["playback"]["speed"] == 0.5)
    assert not page.troubles, page.troubles


def test_seek_by_slider_key_and_mark(replay: Callable[..., Seen]) -> None:
    page = replay()
    started = at_ms(page.state())
    box = page.there("seek").bounding_box()
    page.page.mouse.click(box["x"] + 0.6 * box["width"], box["y"] + box["height"] / 2)
    middle = at_ms(page.wait(lambda s: at_ms(s) > started + 1000))
    page.there("seek").blur()
    page.page.keyboard.press("Home")
    page.wait(lambda s: at_ms(s) == started)
    page.page.keyboard.press("]")
    marked = at_ms(page.wait(lambda s: at_ms(s) > started))
    assert marked < middle
    page.page.locator(".mark.WARNING").first.click(force=True)
    page.wait(lambda s: any(event["text"] == "a gust" for event in s["sections"]["events"]))
    seeds = page.state()["seeds"]
    page.page.keyboard.press("Home")
    page.wait(lambda s: s["seeds"] > seeds and not any(e["text"] == "a gust" for e in s["sections"]["events"]))
    assert not page.troubles, page.troubles


def test_nothing_can_be_commanded(replay: Callable[..., Seen]) -> None:
    page = replay()
    assert "REPLAY" in page.there("replay-badge").inner_text()
    assert not page.there("land-all").is_visible() and not page.there("cut-motors").is_visible()
    page.page.keyboard.press("l")
    page.page.keyboard.press("h")
    page.page.wait_for_timeout(300)
    assert page.state()["orders"] == []


def test_a_reloaded_and_a_second_page_see_the_same(replay: Callable[..., Seen]) -> None:
    page = replay()
    page.page.keyboard.press("End")
    before = page.wait(lambda s: s["playback"]["ended"] and s["pictures"]["frames"] >= 3)
    page.page.reload()
    after = page.wait(lambda s: s.get("playback") and s["trusted"] and s["pictures"]["frames"] >= 3)
    second = replay().wait(lambda s: s["pictures"]["frames"] >= 3)
    for state in (after, second):
        assert state["sections"]["estimate"] == before["sections"]["estimate"]
        assert state["trail"] == before["trail"] and state["samples"] == before["samples"]
        assert state["playback"] == before["playback"]
    page.page.keyboard.press("Home")  # all pages share the controls
    page.wait(lambda s: not s["playback"]["ended"])


@pytest.mark.exhaustive
def test_how_it_looks(replay: Callable[..., Seen], recorded: Recorded) -> None:
    page = replay()
    page.page.keyboard.press("End")
    page.wait(lambda s: s["playback"]["ended"] and s["pictures"]["frames"] >= 3)
    page.page.wait_for_timeout(600)
    page.shot("replay_light")
    page.page.keyboard.press("t")
    page.page.wait_for_timeout(400)
    page.shot("replay_dark")
    page.page.set_viewport_size({"width": 390, "height": 844})
    page.page.wait_for_timeout(600)
    assert page.page.evaluate("() => document.documentElement.scrollWidth") <= 390
    knobs = page.there("play").bounding_box()
    assert knobs["y"] + knobs["height"] <= 844 and knobs["height"] >= 40
    page.shot("replay_phone")


def test_the_fastest_replay_loses_nothing(replay: Callable[..., Seen], recorded: Recorded) -> None:
    page = replay()
    page.there("speed").select_option("20")
    page.there("play").click()
    page.wait(lambda s: s["playback"]["ended"])
    page.page.wait_for_timeout(800)  # some sections are sent four times a second
    fast = page.state()
    page.page.keyboard.press("Home")
    page.wait(lambda s: not s["playback"]["ended"])
    page.page.keyboard.press("End")
    page.wait(lambda s: s["playback"]["ended"])
    page.page.wait_for_timeout(800)  # the moment comes first, its history in the next turn
    sought = page.state()
    for name in _COMPARED:
        assert fast["sections"][name] == sought["sections"][name], name
    for name, length in sought["trail"].items():
        # Points of the trail come with frames: at this speed, one frame drawn late stands for several.
        assert abs(fast["trail"][name] - length) <= max(2, length // 6)
    assert not page.troubles, page.troubles


def test_an_operator_leaves_it_with_ctrl_c(recorded: Recorded, free_port: int) -> None:
    command = [sys.executable, "-m", "groundstation", "replay", str(recorded.folder), "--until-end"]
    options = ["--port", str(free_port), "--speed", "20"]
    done = subprocess.run([*command, *options], capture_output=True, text=True, timeout=60, check=False)
    assert done.returncode == 0, done.stderr
    assert f"http://127.0.0.1:{free_port}/" in done.stdout
    assert Path(recorded.folder).name in done.stdout
