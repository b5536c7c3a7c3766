"""Stages of a run on the page, and the start that the pre-flight checks allow."""

from collections.abc import Iterator
from typing import Any

import pytest
from conftest import Stage
from fake_flight import TARGET, FakeFlight
from seen_page import Seen, eventually

from groundstation.bus.messages import PreflightFinding, Verb

pytestmark = [pytest.mark.browser, pytest.mark.slow]

STAGES = ("pre-flight", "take-off", "form", "track", "land", "over")
BATTERY = PreflightFinding("MUST", "drone_1", "battery 16 % (lands at 15 %)", "charge or exchange its battery")
PADS = PreflightFinding("OK", "pads", "every drone that is seen stands where the field says")
LINK = PreflightFinding("SHOULD", "drone_2", "telemetry 4 Hz", "bring it nearer")


@pytest.fixture
def floor(browser: Any) -> Iterator[Stage]:
    """Two drones that are on the ground and have not flown."""
    flight = FakeFlight()
    flight.modes = dict.fromkeys(flight.modes, "LANDED")
    flight.battery = dict.fromkeys(flight.drones, 0.8)
    made = Stage(browser, flight)
    yield made
    made.close()


def now(page: Seen) -> str:
    return str(page.page.locator("#stages [aria-current]").inner_text())


@pytest.mark.parametrize("size", [(1440, 900), pytest.param((1024, 768), marks=pytest.mark.exhaustive), (390, 844)])
def test_the_stage_is_named_at_every_size(floor: Stage, size: tuple[int, int]) -> None:
    page = floor.open(viewport={"width": size[0], "height": size[1]})
    place = page.there("stages").bounding_box()
    for one, two, stage in (
        ("LANDED", "LANDED", "pre-flight"),
        ("TAKING_OFF", "LANDED", "take-off"),
        ("HOVER", "LANDED", "take-off"),
        ("HOVER", "HOVER", "form"),
        ("TRACK", "TRACK", "track"),
        ("LANDING", "TRACK", "track"),
        ("LANDING", "LANDED", "land"),
    ):
        floor.flight.modes = {"drone_1": one, "drone_2": two}
        eventually(lambda stage=stage: now(page) == stage, what=stage)
    floor.flight.modes = dict.fromkeys(floor.flight.modes, "TRACK")
    floor.flight.unseen_s[TARGET] = 9.0
    eventually(lambda: now(page) == "search", what="search")
    assert page.page.locator("#stages li").count() == len(STAGES)
    assert page.page.locator("#stages li.done").count() == STAGES.index("track")
    assert page.there("stages").bounding_box() == place, "no stage moves the strip"
    inside = page.page.evaluate("() => document.querySelector('#stages').getBoundingClientRect().right <= innerWidth")
    assert inside and place["width"] > 0
    page.page.screenshot(path=str(page.shots() / f"stages_{size[0]}.png"))


def test_a_must_keeps_take_off_shut_until_it_is_mended_or_somebody_insists(floor: Stage) -> None:
    floor.flight.findings = (BATTERY, LINK, PADS)
    page = floor.open()
    take_off = page.there("take-off")
    eventually(take_off.is_disabled, what="TAKE OFF is shut")
    assert "1 must be mended, 1 should" in page.there("findings-sum").inner_text()
    rows = page.there("findings").inner_text()
    assert "battery 16 %" in rows and "charge or exchange" in rows and "telemetry 4 Hz" in rows
    assert "drone_1" in take_off.inner_text() and "battery 16 %" in take_off.get_attribute("title")
    assert "TAKE OFF waits: drone_1: battery 16 %" in page.there("verdict").inner_text()
    assert page.there("drone_1-takeoff").is_disabled() and page.there("drone_2-takeoff").is_enabled()
    page.page.screenshot(path=str(page.shots() / "preflight.png"))
    assert page.there("drone_2-duty").inner_text() == "Stands with its motors off."  # its driver gives no reason

    anyway = page.there("anyway")
    anyway.click()  # one click is not a press of one second
    page.page.wait_for_timeout(1200)
    assert floor.flight.commands == []
    anyway.hover()
    page.page.mouse.down()
    page.page.wait_for_timeout(1300)
    page.page.mouse.up()
    (command,) = eventually(lambda: floor.flight.commands, what="the order")
    assert (command.verb, command.anyway, command.scope) == (Verb.TAKEOFF, True, ("operator",))
    assert command.issuer.startswith("console (viewer ")
    page.there("preflight").wait_for(state="hidden")  # they fly, and the map is shown


def test_a_drone_left_out_for_a_must_may_not_rise_when_it_is_ordered_up_later(floor: Stage) -> None:
    floor.flight.findings = (BATTERY, PADS)
    page = floor.open()
    eventually(page.there("take-off").is_disabled, what="TAKE OFF is shut")
    floor.flight.findings, floor.flight.modes["drone_2"] = (), "TRACK"
    eventually(
        lambda: page.there("take-off").inner_text() == "TAKE OFF\ndrone_1 rises, if able", what="what may happen"
    )
    assert page.there("drone_1-takeoff").inner_text() == "Take off\nrises, if able"


def test_a_resolved_finding_enables_take_off(floor: Stage) -> None:
    floor.flight.findings = (BATTERY, PADS)
    page = floor.open()
    eventually(page.there("take-off").is_disabled, what="TAKE OFF is shut")
    floor.flight.findings = (PADS,)
    eventually(page.there("take-off").is_enabled, what="TAKE OFF is open")
    assert page.there("anyway").is_hidden()
    page.there("take-off").click()
    (command,) = eventually(lambda: floor.flight.commands, what="the order")
    assert not command.anyway
