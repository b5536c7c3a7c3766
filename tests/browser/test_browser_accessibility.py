"""axe-core, the accessibility checker, finds no fault on any page of the console."""

from typing import Any

import pytest
from accessibility import violations

from groundstation.bus.messages import Severity

pytestmark = [pytest.mark.browser, pytest.mark.slow]
DESK, PHONE = (1440, 900), (390, 844)


@pytest.mark.parametrize(
    ("size", "scheme"),
    [
        (DESK, "light"),
        (PHONE, "dark"),
        pytest.param(DESK, "dark", marks=pytest.mark.exhaustive),
        pytest.param(PHONE, "light", marks=pytest.mark.exhaustive),
    ],
)
def test_a_flight_with_alarms_and_old_orders(stage: Any, size: tuple[int, int], scheme: str) -> None:
    page = stage.open(color_scheme=scheme)
    page.page.set_viewport_size({"width": size[0], "height": size[1]})
    stage.flight.event(Severity.ERROR, "drone_1: no navdata for 1 s", "drone_1")
    stage.flight.event(Severity.WARNING, "drone_2: battery low", "drone_2")
    stage.flight.battery["drone_1"] = 0.17
    page.there("hold").click()
    page.wait(lambda s: s["orders"])
    page.page.evaluate("() => document.querySelectorAll('.order').forEach((order) => order.classList.add('old'))")
    page.page.wait_for_timeout(500)
    assert violations(page.page) == []


def test_the_wall(stage: Any) -> None:
    page = stage.open()
    page.page.keyboard.press("w")
    page.page.wait_for_timeout(300)
    assert violations(page.page) == []


def test_a_page_has_one_heading_of_the_first_level(stage: Any) -> None:
    page = stage.open()
    assert page.page.locator("h1").count() == 1
