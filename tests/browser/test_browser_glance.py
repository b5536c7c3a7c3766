"""Bar, alarms and cards describe the same event in the same way."""

from typing import Any

import pytest
from clipping import clipped, covered
from situations import SITUATIONS

pytestmark = [pytest.mark.browser, pytest.mark.slow]


def test_a_landing_for_a_battery_is_told_alike_everywhere(stage: Any) -> None:
    page = stage.open()
    SITUATIONS["all_is_well"](stage.flight)
    page.wait(lambda s: page.there("safety").inner_text() == "SAFE")
    colour = "() => getComputedStyle(document.querySelector('#team-mode')).color"
    calm = page.page.evaluate(colour)
    SITUATIONS["one_has_a_weak_link"](stage.flight)
    page.wait(lambda s: page.there("safety").inner_text() == "ACT")
    assert page.there("team-mode").inner_text() == "TRACK" and page.page.evaluate(colour) != calm
    SITUATIONS["one_lands_for_its_battery"](stage.flight)
    page.wait(lambda s: page.there("battery-lasts").inner_text() == "worst battery, enough to land")
    assert "enough to land" in page.there("card-drone_2").inner_text()
    page.wait(lambda s: "drone_1 lands;\ndrone_2 lands already" in page.there("land-all").inner_text())
    assert clipped(page.page) == [] and covered(page.page) == []
