"""Speech, sounds and vibration for each event; muting never silences those of a stop."""

from typing import Any

import pytest
from fake_flight import TARGET
from seen_page import Seen
from situations import SITUATIONS

from groundstation.bus.messages import Severity

pytestmark = [pytest.mark.browser, pytest.mark.slow]

# Replaces the browser's speech, tones and vibration, and records them.
STUBS = """
  const heard = window.__heard = {spoken: [], tones: [], shakes: []};
  window.SpeechSynthesisUtterance = class { constructor(words) { this.words = words; } };
  const speech = {cancel() {}, speak({words}) { heard.spoken.push(words); }};
  Object.defineProperty(window, "speechSynthesis", {value: speech});
  navigator.vibrate = (pattern) => { heard.shakes.push(pattern); return true; };
  window.AudioContext = class {
    currentTime = 0;
    createOscillator() { const frequency = {};
      return {frequency, connect: (to) => to, start() { heard.tones.push(frequency.value); }, stop() {}}; }
    createGain() { return {gain: {}, connect: (to) => to}; }
  };"""


def heard(page: Seen) -> dict[str, Any]:
    return dict(page.page.evaluate("() => window.__heard"))


def forget(page: Seen) -> None:
    page.page.evaluate("() => Object.values(window.__heard).forEach((list) => { list.length = 0; })")


def listen(stage: Any, muted: bool = False) -> Seen:
    """Return a page on which somebody has pressed a key, without alarms."""
    SITUATIONS["all_is_well"](stage.flight)
    page: Seen = stage.open(script=STUBS)
    page.slow_down(4)  # a machine that is late with the fake flight's messages raises no alarm of its own
    page.wait(lambda s: page.there("worst-battery").inner_text().startswith("71 %"))
    page.page.keyboard.press("m" if muted else "Shift")
    page.page.wait_for_timeout(500)
    forget(page)
    return page


def becomes(page: Seen, words: str, tone: int, shakes: list[int]) -> None:
    """Wait until exactly these words are spoken; then forget them."""
    page.wait(lambda s: words in heard(page)["spoken"])
    assert heard(page) == {"spoken": [words], "tones": [tone], "shakes": [shakes] if shakes else []}
    forget(page)


def test_stops_batteries_alarms_and_a_lost_target_are_heard_and_felt(stage: Any) -> None:
    page = listen(stage)
    stage.flight.battery["drone_2"] = 0.28
    becomes(page, "battery drone_2 low", 520, [150, 100, 150])
    stage.flight.unseen_s[TARGET] = 7.0
    becomes(page, "target lost", 440, [150, 100, 150, 100, 150])
    del stage.flight.unseen_s[TARGET]
    becomes(page, "target found", 660, [])
    stage.flight.event(Severity.ERROR, "its velocity is stuck", "drone_1")
    becomes(page, "drone_1: its velocity is stuck", 520, [150, 100, 150])
    for button, words in (("hold", "hold"), ("land-all", "landing")):
        page.there(button).click()
        becomes(page, words, 880, [400])


def test_muted_only_stops_are_heard_and_felt(stage: Any) -> None:
    page = listen(stage, muted=True)
    assert page.there("sound").get_attribute("aria-pressed") == "false"
    stage.flight.battery["drone_2"] = 0.28
    stage.flight.unseen_s[TARGET] = 7.0
    stage.flight.event(Severity.ERROR, "its velocity is stuck", "drone_1")
    page.wait(lambda s: "stuck" in page.there("banners").inner_text())
    page.wait(lambda s: page.there("team-mode").inner_text() == "SEARCH")
    page.page.wait_for_timeout(500)
    assert heard(page) == {"spoken": [], "tones": [], "shakes": []}
    page.there("hold").click()
    becomes(page, "hold", 880, [400])
    page.page.keyboard.press("l")
    becomes(page, "landing", 880, [400])


def test_a_hidden_page_whose_timers_stand_still_sounds_its_alarms(stage: Any) -> None:
    SITUATIONS["all_is_well"](stage.flight)
    hidden = """
      Object.defineProperty(document, "hidden", {value: true});
      const every = window.setInterval;
      window.setInterval = (act, ms) => every(act, Math.max(ms, 60000));  // as Chromium does after five minutes
    """
    page = stage.open(script=STUBS + hidden)
    stage.flight.battery["drone_2"] = 0.28
    page.wait(lambda s: "battery drone_2 low" in heard(page)["spoken"])
    stage.console.kill()
    page.wait(lambda s: "NO CONNECTION TO THE CONSOLE" in heard(page)["spoken"])


def test_before_the_first_touch_it_only_speaks(stage: Any) -> None:
    SITUATIONS["all_is_well"](stage.flight)
    # The test's own access to the page counts as a touch, so the answer is given in the browser's place.
    untouched = "Object.defineProperty(navigator, 'userActivation', {value: {hasBeenActive: false}});"
    page = stage.open(script=STUBS + untouched)
    stage.flight.battery["drone_2"] = 0.28
    page.wait(lambda s: "battery drone_2 low" in heard(page)["spoken"])
    assert (heard(page)["tones"], heard(page)["shakes"]) == ([], [])
