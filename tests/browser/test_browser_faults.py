"""Parts of the page that fail stop no other, and are told."""

from typing import Any

import pytest
from layout import resize, whole
from situations import SITUATIONS

pytestmark = [pytest.mark.browser, pytest.mark.slow]

# From now on what reads a section fails, or reads it again.
SECTION = """async ([name, fails]) => {
  const { store } = await import("/js/store.js");
  const kept = fails ? store.s[name] : window.kept;
  window.kept = kept;
  const fault = { get() { throw new Error("a fault of the page"); }, set() {}, enumerable: false };
  const sound = { value: kept, writable: true, enumerable: true };
  Object.defineProperty(store.s, name, { ...(fails ? fault : sound), configurable: true });
}"""


def test_a_part_that_fails_leaves_alarms_and_stops_as_they_are_and_is_an_alarm(stage: Any) -> None:
    SITUATIONS["all_is_well"](stage.flight)
    page = stage.open()
    page.wait(lambda s: page.there("safety").inner_text() == "SAFE")
    page.page.evaluate(SECTION, ["flight", True])
    fault = page.there("banner-fault")
    fault.wait_for(timeout=5000)
    assert fault.inner_text().startswith("PAGE FAULT: bar may show what was") and "reload" in fault.inner_text()
    assert page.there("safety").inner_text() == "ACT"
    for size in ((390, 844), (1440, 900)):
        resize(page, size)
        assert whole(page) == [], size
    stage.flight.battery["drone_2"] = 0.18
    page.wait(lambda s: "battery 18%" in page.there("banners").text_content())
    page.wait(lambda s: page.there("drone_2-battery").inner_text() == "18 % low")
    page.there("hold").click()
    page.wait(lambda s: s["orders"] and s["orders"][0]["state"] == "confirmed")
    page.wait(lambda s: "confirmed" in page.there("orders").inner_text())
    page.page.evaluate(SECTION, ["flight", False])
    fault.wait_for(state="detached", timeout=5000)
    page.wait(lambda s: page.there("team-mode").inner_text() == "HOLD")


def test_alarms_that_cannot_be_shown_are_no_reason_to_feel_safe(stage: Any) -> None:
    SITUATIONS["all_is_well"](stage.flight)
    page = stage.open()
    page.wait(lambda s: page.there("safety").inner_text() == "SAFE")
    page.page.evaluate(SECTION, ["safety", True])
    page.wait(lambda s: page.there("safety").inner_text() == "ACT", within_s=5)
    assert page.there("safety-means").inner_text() == "this page fails:\nreload it"
    page.there("land-all").click()
    page.wait(lambda s: [command.verb for command in stage.flight.commands] == ["LAND"])
