"""Captions of buttons: the effect of a press now and the drones concerned, or why a press has no effect."""

import re
from typing import Any

import pytest
from fake_flight import DRONES, TARGET, FakeFlight
from layout import resize, whole
from situations import SITUATIONS

from groundstation.bus import messages as m
from groundstation.bus import topics as t

pytestmark = [pytest.mark.browser, pytest.mark.slow]

# The caption of each button that may not be pressed or would change nothing.
IDLE = """() => [...document.querySelectorAll(":is(.stops, .starts, .actions) button:is(:disabled, .idle) small")]
  .map((one) => one.innerText)"""
REASON = re.compile(r"not now: |no: |no use: |nobody flies|\balready\b|\banyway\b|instead$|^battery unknown$")


def order(flight: FakeFlight, verb: m.Verb, issuer: str) -> None:
    """Command all drones from a program other than the page."""
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
    soon = re.compile(r"\(drone_1 not seen just now: counts as lost in (1\.0|0\.\d) s\)")
    page.wait(lambda s: soon.search(page.there("verdict").inner_text()))
    itself = re.compile(r"Itself not seen for 2\.\d s: counts as lost in (1\.0|0\.\d) s\.")
    page.wait(lambda s: itself.search(page.there("drone_1-duty").inner_text()))
    stage.flight.unseen_s["drone_1"] = 5.0
    page.wait(lambda s: page.there("hold").inner_text() == "HOLD\ndrone_2 hovers;\ndrone_1 lands if unseen")
    assert page.there("drone_1-hold").inner_text() == "Hold\nlands if unseen"
    stage.flight.unseen_s |= {"drone_2": 6.0, TARGET: 9.0}
    page.wait(lambda s: page.there("hold").inner_text() == "HOLD\nboth hover; they land\nif they stay unseen")
    assert page.there("land-all").inner_text().endswith("both land\nwhere they are")
    lost = "Lost: drone_1, drone_2 and turtlebot, not seen for 5 to 9 s."
    page.wait(lambda s: lost in page.there("verdict").inner_text())


def test_watch_says_who_lands_by_itself_why_and_when(stage: Any) -> None:
    SITUATIONS["all_is_well"](stage.flight)
    page = stage.open()
    means = page.there("safety-means")
    stage.flight.unseen_s = {"drone_1": 10.0, "drone_2": 9.0, TARGET: 10.0}
    page.wait(lambda s: re.fullmatch(r"unseen: both\nland within (20|19) s", means.inner_text()))
    stage.flight.lands_in_s["drone_1"] = 6.0
    page.wait(lambda s: means.inner_text() == "unseen: one\nlanding in 6 s")
    stage.flight.unseen_s = {}
    page.wait(lambda s: means.inner_text() == "one starts to\nland in 6 s")
    SITUATIONS["the_tracker_is_silent"](stage.flight)
    page.wait(lambda s: means.inner_text() == "no tracker: both\nlanding in 1 s")
    assert page.there("team-mode").inner_text() == "LANDS IN 1 s"
    assert page.there("banner-tracker").inner_text().startswith("TRACKER SILENT")


def test_a_page_states_the_present(stage: Any) -> None:
    """A drone is to be watched that nobody watches yet; one hovers already; a target is lost."""
    SITUATIONS["all_is_well"](stage.flight)
    page = stage.open()
    SITUATIONS["one_has_a_stuck_sensor"](stage.flight)
    page.wait(lambda s: page.there("drone_2-hold").inner_text() == "Hold\nuntil RESUME")
    page.wait(lambda s: page.there("turtlebot-duty").inner_text() == "Seen: drone_1 tracks it.")
    page.wait(lambda s: page.there("turtlebot-speed").inner_text().endswith(" m/s"))
    SITUATIONS["all_is_well"](stage.flight)
    SITUATIONS["the_target_is_lost"](stage.flight)
    page.wait(lambda s: page.there("turtlebot-speed").inner_text() == "unknown")
    looks = "Looks for turtlebot, which nobody sees. Seen by ceiling camera."
    page.wait(lambda s: page.there("drone_1-duty").inner_text() == looks)
    assert page.page.locator("#switch").is_hidden()


def test_silent_drones_are_described_alike_in_all_captions(stage: Any) -> None:
    SITUATIONS["all_are_held"](stage.flight)
    page = stage.open()
    page.wait(lambda s: page.there("hold").inner_text() == "HOLD\nboth hover already")
    stage.flight.mute = set(DRONES)
    page.wait(lambda s: page.there("safety-means").inner_text() == "not heard: both\nhover, then land")
    assert page.there("team-mode").inner_text() == "NOT HEARD" and page.there("team-who").inner_text() == "team"
    assert page.there("hold").inner_text() == "HOLD\nboth hover\nif they hear"
    assert page.there("cut-motors").inner_text() == "CUT MOTORS\nboth fall\nif they hear"
    assert page.there("verdict").inner_text().startswith("drone_1 and drone_2 are not heard.")
    for name in DRONES:
        assert page.there(f"{name}-duty").inner_text().startswith("It is not heard: it hovers, then lands by itself.")
        assert page.there(f"{name}-land").inner_text() == "Land\nif it hears"


def test_a_drone_that_falls_silent_in_its_landing_lands_in_all_words(stage: Any) -> None:
    SITUATIONS["all_land"](stage.flight)
    page = stage.open()
    page.wait(lambda s: page.there("drone_1-mode").inner_text() == "landing")
    stage.flight.mute = {"drone_1"}
    page.wait(lambda s: page.there("drone_1-duty").inner_text() == "It is not heard: it lands. Stops are sent to it.")
    page.wait(lambda s: "Nothing to do: it lands. Stops are sent" in page.there("banners").text_content())


def test_drones_that_were_never_heard_are_not_called_safe_on_the_ground(large_stage: Any) -> None:
    flight = large_stage.flight
    flight.modes, flight.battery = dict.fromkeys(flight.drones, "CONNECTING"), {}
    page = large_stage.open()
    page.wait(lambda s: page.there("safety").inner_text() == "WATCH")
    said = "Not every drone has been heard yet: it is not known whether 8 drones fly."
    page.wait(lambda s: page.there("banners").inner_text() == said)
    assert page.there("verdict").inner_text().startswith("It is not known whether 8 drones fly. TAKE OFF")
    assert page.there("hold").inner_text() == "HOLD\nif one flies" and page.there("team-mode").inner_text() == "UNKNOWN"
    assert page.there("track").inner_text() == "TRACK\nnot now: not heard"
    for size in ((1440, 900), (390, 844)):
        resize(page, size)
        assert whole(page) == [], size
    page.shot("never_heard")


def test_hold_tells_that_drones_land_without_the_tracker_also_while_one_is_not_heard(stage: Any) -> None:
    SITUATIONS["all_is_well"](stage.flight)
    page = stage.open()
    stage.flight.frozen, stage.flight.mute = True, {"drone_2"}
    said = "HOLD\ndrone_1 hovers,\nthen lands;\ndrone_2 if it hears"
    page.wait(lambda s: page.there("hold").inner_text() == said)


def test_a_drone_in_the_dark_is_not_shown_as_searching(stage: Any) -> None:
    SITUATIONS["the_target_is_lost"](stage.flight)
    page = stage.open()
    stage.flight.dark = True
    page.wait(lambda s: page.there("team-mode").inner_text() == "BLIND")
    blind = "Has no light to look for turtlebot. "
    page.wait(lambda s: page.there("drone_1-duty").inner_text().startswith(blind))
    assert "Also: dark pictures, turtlebot lost" in page.there("banners").inner_text()


def test_a_start_says_who_goes_on_and_whether_it_can(stage: Any) -> None:
    SITUATIONS["all_is_well"](stage.flight)
    page = stage.open()
    stage.flight.modes["drone_2"] = "HOVER"
    stage.flight.detail["drone_2"] = "hovers after its take-off, waiting for TRACK"
    page.wait(lambda s: page.there("track").inner_text() == "TRACK\ndrone_2 tracks")
    assert page.there("verdict").inner_text().endswith("TRACK lets drone_2 track.")
    stage.flight.detail["drone_2"] = "reported velocity stuck at 0.00 m/s; RESUME is needed"
    page.wait(lambda s: page.there("resume").inner_text() == "RESUME\ndrone_2 tracks again")
    stage.flight.lands_in_s["drone_2"] = 2.0
    duty = "Hovers, then lands: reported velocity stuck at 0.00 m/s"
    page.wait(lambda s: page.there("drone_2-duty").inner_text() == f"{duty}. RESUME lets it go on.")
    assert page.there("resume").inner_text() == "RESUME\ndrone_2 tracks again"
    stage.flight.detail["drone_2"] = "reported velocity stuck at 0.00 m/s"
    page.wait(lambda s: page.there("drone_2-duty").inner_text() == f"{duty}.")
    assert "RESUME" not in page.there("verdict").inner_text()


def test_a_crashed_drone_cannot_take_off_while_others_fly(stage: Any) -> None:
    SITUATIONS["all_is_well"](stage.flight)
    page = stage.open()
    stage.flight.states["drone_2"], stage.flight.modes["drone_2"] = m.FlightState.EMERGENCY, "CUT"
    stage.flight.detail["drone_2"] = "the vehicle reports an emergency"
    page.wait(lambda s: page.there("take-off").inner_text() == "TAKE OFF\ncheck drone_2")
    assert page.there("take-off").is_disabled() and page.there("drone_2-takeoff").is_disabled()
    assert page.there("drone_2-takeoff").inner_text() == "Take off\ncheck it first"
    assert page.there("drone_2-duty").inner_text() == "Is on the floor: it cut its motors itself."
    assert page.there("hold").inner_text() == "HOLD\ndrone_1 hovers;\ndrone_2 is down"
    assert page.there("drone_2-land").inner_text() == "Land\nno use: down"
    stage.flight.detail["drone_2"] = "motors cut by operator"
    ordered = "Is on the floor, motors off: CUT MOTORS ordered at the terminal"
    page.wait(lambda s: page.there("drone_2-duty").inner_text().startswith(ordered))
    stage.flight.states.clear()  # a vehicle that does not count cut motors as an emergency
    page.wait(lambda s: s["sections"]["vehicles"]["drone_2"]["flight"] == "LANDED")
    assert page.there("take-off").inner_text() == "TAKE OFF\ncheck drone_2"
    assert page.there("hold").inner_text() == "HOLD\ndrone_1 hovers;\ndrone_2 is down"
    stage.flight.modes["drone_1"] = "LANDED"
    page.wait(lambda s: page.there("drone_2-takeoff").inner_text() == "Take off\nrises, if able")


def test_a_drone_that_flies_on_after_its_motors_were_cut_is_not_called_down(stage: Any) -> None:
    SITUATIONS["all_is_well"](stage.flight)
    page = stage.open()
    stage.flight.states["drone_2"], stage.flight.modes["drone_2"] = m.FlightState.FLYING, "CUT"
    stage.flight.detail["drone_2"] = "motors cut by operator"
    page.wait(lambda s: page.there("drone_2-duty").inner_text().startswith("Falls, or flies on: CUT MOTORS"))
    assert page.there("drone_2-land").inner_text() == "Land\nlands here"
    assert page.there("drone_2-hold").inner_text() == "Hold\nlands anyway"
    assert "is down" not in page.there("hold").inner_text()


def test_minutes_are_of_who_flies_or_might(stage: Any) -> None:
    SITUATIONS["all_is_well"](stage.flight)
    page = stage.open()
    stage.flight.modes["drone_2"] = "LANDED"
    titles = [page.there(f"{name}-battery").locator("xpath=preceding-sibling::dt") for name in DRONES]
    page.wait(lambda s: titles[1].inner_text() == "battery")
    assert titles[0].inner_text().startswith("good for ")
    stage.flight.modes["drone_1"] = "LANDED"
    page.wait(lambda s: titles[1].inner_text().startswith("good for "))
    stage.flight.battery["drone_2"] = 0.16
    page.wait(lambda s: page.there("worst-battery").inner_text() == "16 % drone_2")
    assert (page.there("battery-lasts").inner_text(), titles[1].inner_text()) == ("worst battery", "battery")


def test_without_the_tracker_nobody_is_said_to_be_lost(stage: Any) -> None:
    SITUATIONS["all_is_well"](stage.flight)
    page = stage.open()
    stage.flight.unseen_s["drone_1"] = 5.0
    lost = "Lost: lands within 25\u00a0s, unless seen. Until then it tracks turtlebot"
    page.wait(lambda s: page.there("drone_1-duty").inner_text().startswith(lost))
    said = "drone_2 tracks the target; drone_1 flies on unseen. Lost: drone_1, not seen for 5 s."
    assert page.there("verdict").inner_text() == said
    stage.flight.frozen = True
    page.wait(lambda s: page.there("banner-tracker").is_visible())
    assert "lost" not in page.there("banners").inner_text()
    assert page.there("drone_2-seen").inner_text() == "in view"
    stage.flight.modes = dict.fromkeys(DRONES, "LANDED")
    page.wait(lambda s: page.there("banner-tracker").inner_text().endswith("Nothing to do: nobody flies."))


def test_a_card_states_what_a_drone_does_now_and_why(stage: Any) -> None:
    page = stage.open()
    for situation, name, words in (
        ("the_target_is_lost", "drone_1", "Looks for turtlebot, which nobody sees"),
        (
            "one_is_unseen_and_will_land",
            "drone_1",
            "Tracks turtlebot, then lands: not seen by any camera for too long.",
        ),
        ("one_stands_with_an_unknown_battery", "drone_2", "Stands, motors off. Reason for landing: its battery is unk"),
    ):
        SITUATIONS["all_is_well"](stage.flight)
        SITUATIONS[situation](stage.flight)
        page.wait(lambda s, at=f"{name}-duty", said=words: page.there(at).inner_text().startswith(said))


def test_a_battery_that_lands_well_charged_does_not_count_while_others_fly(stage: Any) -> None:
    SITUATIONS["all_is_well"](stage.flight)
    page = stage.open()
    stage.flight.battery, stage.flight.modes["drone_2"] = {"drone_1": 0.9, "drone_2": 0.7}, "LANDING"
    page.wait(lambda s: page.there("worst-battery").inner_text() == "90 % drone_1")
    assert page.there("battery-lasts").inner_text().startswith("worst flying on, good for")
    stage.flight.battery["drone_2"] = 0.14
    page.wait(lambda s: page.there("worst-battery").inner_text() == "14 % drone_2")


def test_orders_passed_on_by_the_terminal_are_attributed_to_their_sender(stage: Any) -> None:
    SITUATIONS["all_are_held"](stage.flight)
    page = stage.open()
    page.wait(lambda s: page.there("resume").is_enabled())
    page.there("resume").click()
    page.wait(lambda s: [one.verb for one in stage.flight.commands] == ["RESUME"])
    order(stage.flight, m.Verb.RESUME, "operator")
    page.wait(lambda s: ("operator", "confirmed") in [(one["by"], one["state"]) for one in s["orders"]])
    stage.flight.modes = dict.fromkeys(DRONES, "TRACK")
    page.wait(lambda s: page.there("drone_1-duty").inner_text().startswith("Tracks turtlebot, ordered by you: "))
    page.wait(lambda s: any("passed on for you" in line for line in page.there("order").all_inner_texts()))
    order(stage.flight, m.Verb.TRACK, "operator")
    page.wait(lambda s: page.there("drone_1-duty").inner_text().startswith("Tracks turtlebot, ordered at the terminal"))


def test_a_drone_whose_sightings_contradict_its_estimate_is_named(stage: Any) -> None:
    stage.flight.unplaced_s["drone_2"], stage.flight.battery["drone_2"] = 9.0, 0.9
    page = stage.open()
    page.wait(lambda s: "It is not known yet where drone_2 is." in page.there("verdict").inner_text())
    page.wait(lambda s: "drone_2: not known where it is for 9 s" in page.there("banners").inner_text())
    assert "Nobody is lost" not in page.there("verdict").inner_text()
