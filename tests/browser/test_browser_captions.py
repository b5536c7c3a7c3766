"""What a button says: what a press does now, to whom, or in words that no effect has why it does nothing."""

import re
from typing import Any

import pytest
from fake_flight import DRONES, TARGET, FakeFlight
from situations import SITUATIONS

from groundstation.bus import messages as m
from groundstation.bus import topics as t

pytestmark = [pytest.mark.browser, pytest.mark.slow]

# Of each button that may not be pressed, or would change nothing: its caption.
IDLE = """() => [...document.querySelectorAll(":is(.stops, .starts, .actions) button:is(:disabled, .idle) small")]
  .map((one) => one.innerText)"""
REASON = re.compile(r"not now: |no: |no use: |nobody flies|\balready\b|\banyway\b|instead$|^battery unknown$")


def order(flight: FakeFlight, verb: m.Verb, issuer: str) -> None:
    """Order all drones, as a program that is not the page does."""
    bus = flight.bus(issuer)
    header = bus.header(issuer)
    bus.publish(t.COMMAND, m.Command(header=header, id=f"{issuer}-{verb}", verb=verb, scope=DRONES, issuer=issuer))


def test_no_reason_reads_as_an_effect(stage: Any) -> None:
    page = stage.open()
    for name, arrange in SITUATIONS.items():
        SITUATIONS["all_is_well"](stage.flight)
        page.page.wait_for_timeout(300)
        arrange(stage.flight)
        page.page.wait_for_timeout(700)
        captions = page.page.evaluate(IDLE)
        assert captions and all(map(REASON.search, captions)), (name, captions)


def test_the_word_has_its_meaning_below_it(stage: Any) -> None:
    page = stage.open()
    means = {"SAFE": "no problem", "WATCH": "a problem, but\nno need to act", "ACT": "a problem:\nact now"}
    for name in ("all_is_well", "all_land", "the_target_is_lost", "one_has_a_weak_link"):
        SITUATIONS["all_is_well"](stage.flight)
        SITUATIONS[name](stage.flight)
        level = {"the_target_is_lost": "WATCH", "one_has_a_weak_link": "ACT"}.get(name, "SAFE")
        page.wait(lambda s, level=level: page.there("safety").inner_text() == level)
        assert page.there("safety-means").inner_text() == means[level]


def test_hold_says_what_becomes_of_who_is_lost(stage: Any) -> None:
    SITUATIONS["all_is_well"](stage.flight)
    page = stage.open()
    stage.flight.unseen_s["drone_1"] = 2.0
    page.wait(lambda s: "(drone_1 not seen just now: lost after 3 s)" in page.there("verdict").inner_text())
    stage.flight.unseen_s["drone_1"] = 5.0
    page.wait(lambda s: page.there("hold").inner_text() == "HOLD\ndrone_2 hovers;\ndrone_1 hovers if seen")
    assert page.there("drone_1-hold").inner_text() == "Hold\nhovers if seen"
    stage.flight.unseen_s |= {"drone_2": 6.0, TARGET: 9.0}
    page.wait(lambda s: page.there("hold").inner_text() == "HOLD\nboth hover; they land\nif they stay unseen")
    lost = "Lost: drone_1, drone_2 and turtlebot, not seen for 5 to 9 s."
    page.wait(lambda s: lost in page.there("verdict").inner_text())


def test_a_start_says_who_goes_on_and_whether_it_can(stage: Any) -> None:
    SITUATIONS["all_is_well"](stage.flight)
    page = stage.open()
    stage.flight.modes["drone_2"] = "HOVER"
    stage.flight.detail["drone_2"] = "hovers after its take-off, waiting for TRACK"
    page.wait(lambda s: page.there("track").inner_text() == "TRACK\ndrone_2 tracks")
    assert page.there("verdict").inner_text().endswith("TRACK lets drone_2 track.")
    stage.flight.detail["drone_2"] = "its velocity is stuck at 0.00 m/s; RESUME is needed"
    page.wait(lambda s: page.there("resume").inner_text() == "RESUME\ndrone_2 tracks again")
    stage.flight.lands_in_s["drone_2"] = 2.0
    page.wait(lambda s: page.there("resume").inner_text() == "RESUME\ndrone_2 tracks, if able")
    assert page.there("drone_2-duty").inner_text() == "Hovers, then lands: its velocity is stuck at 0.00 m/s."
    assert "RESUME" not in page.there("verdict").inner_text()


def test_a_battery_that_lands_well_charged_does_not_count_while_others_fly(stage: Any) -> None:
    SITUATIONS["all_is_well"](stage.flight)
    page = stage.open()
    stage.flight.battery, stage.flight.modes["drone_2"] = {"drone_1": 0.9, "drone_2": 0.7}, "LANDING"
    page.wait(lambda s: page.there("worst-battery").inner_text() == "90 % drone_1")
    assert page.there("battery-lasts").inner_text().startswith("worst flying on, good for")
    stage.flight.battery["drone_2"] = 0.14
    page.wait(lambda s: page.there("worst-battery").inner_text() == "14 % drone_2")


def test_who_asked_the_terminal_is_who_ordered_it(stage: Any) -> None:
    SITUATIONS["all_are_held"](stage.flight)
    page = stage.open()
    page.wait(lambda s: page.there("resume").is_enabled())
    page.there("resume").click()
    page.wait(lambda s: [one.verb for one in stage.flight.commands] == ["RESUME"])
    order(stage.flight, m.Verb.RESUME, "operator")
    page.wait(lambda s: ("operator", "confirmed") in [(one["by"], one["state"]) for one in s["orders"]])
    stage.flight.modes = dict.fromkeys(DRONES, "TRACK")
    page.wait(lambda s: page.there("drone_1-duty").inner_text().startswith("Tracks turtlebot, ordered by you: "))
    page.wait(lambda s: any("terminal for you" in line for line in page.there("order").all_inner_texts()))
    order(stage.flight, m.Verb.TRACK, "operator")
    page.wait(lambda s: page.there("drone_1-duty").inner_text().startswith("Tracks turtlebot, ordered at the terminal"))
