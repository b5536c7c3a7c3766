"""Layout: stops and alarms keep their place, nothing is clipped at any size, and the bar states the team's activity."""

from typing import Any

import pytest
from clipping import clipped, covered
from fake_flight import DRONES, TARGET, FakeFlight
from fonts import REMEMBER
from layout import resize, whole
from on_demand import on_demand
from places import boxes, moved
from situations import SITUATIONS

from groundstation.bus.messages import RUN, Severity

pytestmark = [pytest.mark.browser, pytest.mark.slow]

USUAL, FURTHER = ((1440, 900), (390, 844)), ((1024, 768), (2560, 1440))  # a desk's and a phone's; on demand
SIZES = [*USUAL, *on_demand(FURTHER)]


def ten_alarms(flight: FakeFlight) -> None:
    for number in range(10):
        flight.event(Severity.ERROR, f"trouble {number} that takes some words to tell", f"drone_{1 + number % 2}")
    flight.battery["drone_1"], flight.link["drone_1"] = 0.03, 0.08
    flight.battery["drone_2"] = 0.17
    flight.braked.add("drone_2")
    flight.detail["drone_2"] = "hovers: its sensors cannot be believed: reported velocity stuck at 0.27 m/s"
    flight.lands_in_s["drone_1"] = 12.0
    flight.detail["drone_1"] = "not seen by any camera for too long"


@pytest.mark.parametrize("size", SIZES)
def test_nothing_moves_while_alarms_and_orders_come(stage: Any, size: tuple[int, int]) -> None:
    page = stage.open()
    SITUATIONS["all_is_well"](stage.flight)
    resize(page, size)
    page.wait(lambda s: page.there("banner-none").is_visible() and page.there("drone_2-battery").inner_text() == "71 %")
    before = boxes(page)
    assert {"hold", "land-all", "cut-motors", "card-drone_1", "card-drone_2", "card-turtlebot"} <= set(before)
    assert {f"{name}-{verb}" for name in DRONES for verb in ("takeoff", "hold", "land")} <= set(before)
    ten_alarms(stage.flight)
    page.wait(lambda s: page.there("drone_1-mode").inner_text() == "lands in 12 s")
    assert moved(page, before) == {}
    stage.flight.frozen = True
    page.there("hold").click()
    page.there("drone_2-land").click()
    page.there("banner-tracker").wait_for(state="attached", timeout=20_000)
    page.wait(lambda s: len(s["orders"]) == 2)
    page.page.wait_for_timeout(700)
    assert moved(page, before) == {}
    assert whole(page) == []
    page.there("more-alarms").click()
    assert page.page.locator(".banner:visible").count() > 1
    assert moved(page, before) == {}
    page.shot(f"alarms_open_{size[0]}")


@pytest.mark.parametrize("size", SIZES)
def test_no_text_is_cut_off_from_the_flight_to_the_end_of_the_run(stage: Any, size: tuple[int, int]) -> None:
    page = stage.open()
    resize(page, size)
    assert whole(page) == []
    ten_alarms(stage.flight)
    stage.flight.modes["drone_2"] = "TAKING_OFF"
    page.there("hold").click()
    page.wait(lambda s: s["orders"])
    page.page.wait_for_timeout(800)
    assert whole(page) == []
    stage.flight.battery = {"drone_1": 0.9, "drone_2": None}
    page.wait(lambda s: page.there("worst-battery").inner_text().split() == ["unknown", "drone_2"])
    assert page.there("battery-lasts").inner_text() == "worst battery"
    assert whole(page) == []
    page.shot(f"layout_{size[0]}")
    stage.flight.event(Severity.WARNING, "run ended: not every drone reported a landing", RUN)
    page.there("banner-ended").wait_for(timeout=20_000)
    stage.console.terminate()
    page.wait(lambda s: not s["connected"])
    page.page.wait_for_timeout(500)
    assert whole(page) == []


def test_the_whole_team_is_in_sight(stage: Any) -> None:
    """Mode, battery and stops of each drone, without scrolling; on a phone above the stops for all."""
    page = stage.open()
    ten_alarms(stage.flight)
    for size in USUAL + FURTHER:
        resize(page, size)
        phone = page.there("land-all").bounding_box()["y"] > size[1] / 2
        edge = page.there("land-all").bounding_box()["y"] if phone else size[1]
        for name in ("mode", "battery", "hold", "land"):
            for drone in DRONES:
                box = page.there(f"{drone}-{name}").bounding_box()
                assert box["y"] + box["height"] <= edge, (size, drone, name)
        target = page.there("card-turtlebot").bounding_box()
        assert target["y"] + target["height"] <= edge, size


def test_an_alarm_of_any_length_can_be_read(stage: Any) -> None:
    page = stage.open()
    SITUATIONS["all_is_well"](stage.flight)
    resize(page, (390, 844))
    page.wait(lambda s: page.there("banner-none").is_visible())
    assert page.there("more-alarms").is_hidden()
    stage.flight.event(Severity.ERROR, f"it is {'very, ' * 60}very wrong", "drone_2")
    page.wait(lambda s: page.there("more-alarms").is_visible())
    assert page.there("more-alarms").inner_text() == "whole text"
    before = boxes(page)
    page.there("more-alarms").click()
    assert whole(page) == [] and moved(page, before) == {}


@pytest.mark.exhaustive
def test_the_bar_says_how_long_the_worst_battery_lasts(stage: Any) -> None:
    """At first by the usual drain of its kind; after a minute this flight's own drain has full weight."""
    page = stage.open()
    stage.flight.battery = {"drone_1": 0.9, "drone_2": 0.6}
    page.wait(lambda s: page.there("worst-battery").inner_text() == "60 % drone_2")
    assert page.there("battery-lasts").inner_text() == "worst battery, good for ~5 min"
    page.page.wait_for_timeout(61_000)
    stage.flight.battery["drone_2"] = 0.5
    page.wait(lambda s: page.there("battery-lasts").inner_text() == "worst battery, good for ~3 min")
    stage.flight.battery["drone_1"] = 0.52  # it has spent more
    page.wait(lambda s: page.there("worst-battery").inner_text() == "52 % drone_1")
    assert page.there("battery-lasts").inner_text() == "drains fastest, good for ~1 min"
    stage.flight.modes["drone_2"] = "LANDED"
    page.wait(lambda s: "good for" not in page.there("card-drone_2").inner_text())  # on the ground while others fly
    assert "good for ~1 min" in page.there("card-drone_1").inner_text()


def test_the_bar_says_what_the_team_does(stage: Any) -> None:
    page = stage.open()
    page.wait(lambda s: page.there("team-mode").inner_text() == "TRACK")
    page.wait(lambda s: page.there("worst-battery").inner_text() == "34 % drone_2")
    page.wait(lambda s: page.there("recording").inner_text() == "on")
    assert page.there("air-time").inner_text().startswith("≥ 0:")
    stage.flight.modes["drone_1"] = "LANDING"
    page.wait(lambda s: page.there("team-mode").inner_text() == "LANDING + TRACK")
    assert page.there("team-who").inner_text() == "drone_1 + drone_2"
    stage.flight.modes = {"drone_1": "LANDED", "drone_2": "LANDED"}
    page.wait(lambda s: page.there("team-mode").inner_text() == "ON GROUND")
    stage.flight.battery["drone_1"] = None
    page.wait(lambda s: page.there("worst-battery").inner_text() == "unknown drone_1")


def test_one_sentence_says_what_the_team_does_and_what_may_be_done(stage: Any) -> None:
    page = stage.open()
    verdict = page.there("verdict")
    stage.flight.battery["drone_2"] = 0.6
    page.wait(lambda s: verdict.inner_text() == "drone_1 and drone_2 track the target. Nobody is lost.")
    page.wait(lambda s: page.there("safety").inner_text() == "SAFE")
    lasting = "No alarms. All who fly are heard, nobody is lost; the first must land for its battery in ~5 min."
    assert page.there("banner-none").inner_text() == lasting
    stage.flight.modes = {"drone_1": "HOLD", "drone_2": "TRACK"}
    said = "drone_2 tracks the target; drone_1 hovers. Nobody is lost. RESUME lets drone_1 track."
    page.wait(lambda s: verdict.inner_text() == said)
    stage.flight.battery["drone_2"] = 0.28
    low = "drone_2: battery 28%, good for ~1 min\nNothing to do yet: at 15% a drone lands by itself."
    page.wait(lambda s: page.there("banner-alarm").inner_text() == low)
    assert page.there("safety").inner_text() == "WATCH"
    stage.flight.battery["drone_2"] = 0.6
    stage.flight.unseen_s[TARGET] = 4.0
    page.wait(lambda s: "Lost: turtlebot, not seen for 4 s." in verdict.inner_text())
    page.shot("verdict")
    stage.flight.modes = {"drone_1": "LANDED", "drone_2": "LANDED"}
    page.wait(lambda s: verdict.inner_text() == "Nobody flies. TAKE OFF flies again.")


def test_each_drone_says_what_it_does_and_why(stage: Any) -> None:
    page = stage.open()
    duty = page.there("drone_1-duty")
    page.wait(lambda s: duty.inner_text().startswith("Tracks turtlebot, ordered at the terminal: watches it. "))
    assert "Seen by ceiling camera." in duty.inner_text()
    stage.flight.fenced = True
    page.wait(lambda s: "Slowed by the fence." in page.there("drone_2-duty").inner_text())
    stage.flight.detail["drone_1"] = "hovers: no telemetry from the vehicle"
    stage.flight.lands_in_s["drone_1"] = 1.8
    stage.flight.braked.add("drone_1")
    page.wait(lambda s: duty.inner_text() == "Hovers: no telemetry from the vehicle.")
    page.wait(lambda s: "drone_1 starts to land in 2 s: no telemetry" in page.there("banner-alarm").first.inner_text())
    assert page.there("drone_1-mode").inner_text() == "lands in 2 s"
    assert page.there("hold").inner_text() == "HOLD\ndrone_2 hovers;\ndrone_1 lands anyway"
    assert page.there("drone_1-hold").inner_text() == "Hold\nlands anyway"
    assert page.there("drone_2-hold").inner_text() == "Hold\nhovers here"
    assert page.there("drone_2-takeoff").inner_text() == "Take off\nflying already"
    stage.flight.detail.clear()
    stage.flight.lands_in_s.clear()
    stage.flight.braked.clear()
    stage.flight.modes["drone_1"] = "HOLD"
    page.wait(lambda s: duty.inner_text() == "Hovers in place: HOLD ordered at the terminal.")
    assert page.there("hold").inner_text() == "HOLD\nboth hover in place"
    stage.flight.modes = {"drone_1": "LANDED", "drone_2": "LANDED"}
    page.wait(lambda s: page.there("hold").inner_text() == "HOLD\nnobody flies")
    assert page.there("take-off").inner_text() == "TAKE OFF\nboth rise, one by one"


# Safety and its reason, who does what, the effect of HOLD, and the modes on the cards of both drones.
TOLD = {
    "all_is_well": ("SAFE", "No alarms", "track the target. Nobody is lost.", "both hover in place", "track", "track"),
    "one_lands_for_its_battery": (
        *("WATCH", "battery 13%, it lands", "drone_1 tracks the target; drone_2 lands."),
        *("drone_1 hovers;\ndrone_2 lands anyway", "track", "landing"),
    ),
    "all_are_held": ("SAFE", "No alarms", "RESUME lets them track.", "both hover already", "hold", "hold"),
    "one_is_unseen_and_will_land": (
        *("WATCH", "drone_1 starts to land in 6 s", "Lost: drone_1, not seen for 4 s"),
        *("drone_2 hovers;\ndrone_1 lands anyway", "lands in 6 s", "track"),
    ),
    "the_tracker_is_silent": (
        *("WATCH", "TRACKER SILENT"),
        "in 1 s. No tracker tells if anyone is lost; cameras still see all.",
        *("both land anyway", "lands in 1 s", "lands in 1 s"),
    ),
    "one_has_a_stuck_sensor": (
        *("WATCH", "stuck at 0.27 m/s", "drone_2 hovers. Nobody", "hover in place", "track", "hover"),
    ),
    "all_land": ("SAFE", "No alarms", "drone_1 and drone_2 land.", "both land anyway", "landing", "landing"),
    "one_has_a_weak_link": ("ACT", "weak link, 31%", "Nobody is lost.", "hover in place", "track", "track"),
    "one_stands_with_an_unknown_battery": (
        *("ACT", "battery 19%, good for < 1 min", "drone_2 stands."),
        *("drone_1 hovers;\ndrone_2 stands", "track", "landed"),
    ),
    "the_target_is_lost": (
        *("WATCH", "turtlebot is lost: not seen for 7 s", "look for the target. Lost: turtlebot, not seen for 7 s"),
        *("hover in place", "search", "search"),
    ),
}


@pytest.mark.parametrize("sizes", [USUAL, pytest.param(USUAL + FURTHER, marks=pytest.mark.exhaustive)], ids=len)
def test_every_situation_is_told_in_one_way_and_moves_nothing(stage: Any, sizes: tuple[tuple[int, int], ...]) -> None:
    SITUATIONS["all_is_well"](stage.flight)
    page = stage.open(script=REMEMBER)
    places = [page.there(name) for name in ("safety", "banners", "verdict", "hold", "drone_1-mode", "drone_2-mode")]

    def told(name: str) -> bool:
        return all(words in place.inner_text() for words, place in zip(TOLD[name], places, strict=True))

    page.wait(lambda s: told("all_is_well"))
    stands = {}
    for size in sizes:
        resize(page, size)
        stands[size] = boxes(page)
    for name, arrange in SITUATIONS.items():
        SITUATIONS["all_is_well"](stage.flight)
        page.page.wait_for_timeout(300)  # until the page has received it
        arrange(stage.flight)
        page.wait(lambda s, name=name: told(name))
        page.page.wait_for_timeout(700)  # until observations of the previous situation no longer count
        for size in sizes:
            resize(page, size)
            assert whole(page) == [], (name, size)
            assert moved(page, stands[size]) == {}, (name, size)
        resize(page, sizes[0])
        page.shot(f"situation_{name}")


def test_only_starts_that_would_be_accepted_are_offered(stage: Any) -> None:
    page = stage.open()
    page.wait(lambda s: page.there("take-off").get_attribute("title") == "flying already")
    assert page.there("take-off").is_disabled() and page.there("drone_1-takeoff").is_disabled()
    assert page.there("track").get_attribute("title") == "tracking already"
    stage.flight.modes = {"drone_1": "LANDED", "drone_2": "HOLD"}
    page.wait(lambda s: page.there("drone_1-takeoff").is_enabled())
    assert page.there("resume").is_enabled() and page.there("drone_2-takeoff").is_disabled()
    assert page.there("track").inner_text() == "TRACK\npress RESUME instead"
    page.there("drone_1-takeoff").click()
    page.wait(lambda s: [command.scope for command in stage.flight.commands] == [("operator", "drone_1")])
    stage.flight.frozen = True
    page.wait(lambda s: page.there("resume").get_attribute("title") == "no tracker")
    assert page.there("track").is_disabled()


def test_the_wall_is_read_from_three_metres(stage: Any) -> None:
    page = stage.open(script=REMEMBER)
    page.page.set_viewport_size({"width": 1920, "height": 1080})
    page.page.keyboard.press("w")
    page.page.wait_for_timeout(500)
    sizes = page.page.evaluate(
        """() => [...document.querySelectorAll("#shell dd, #team dd")].filter((figure) => figure.checkVisibility())
             .map((figure) => parseFloat(getComputedStyle(figure).fontSize))"""
    )
    assert len(sizes) >= 9 and min(sizes) >= 45
    assert whole(page) == []
    page.shot("wall")


# A phone on its side, a desk's page at 300 %, and the narrowest phone.
@pytest.mark.parametrize("size", [(320, 568), *on_demand([(844, 390), (480, 300)])], ids=str)
def test_a_low_or_narrow_screen_has_the_stops_and_reaches_the_team(stage: Any, size: tuple[int, int]) -> None:
    SITUATIONS["all_is_well"](stage.flight)
    page = stage.open()
    resize(page, size)
    page.wait(lambda s: page.there("banner-none").is_visible())
    assert clipped(page.page) == [] and covered(page.page) == []
    page.there("drone_1-land").click(timeout=5000)  # an element above it would get the click
    for stop in ("hold", "land-all"):
        page.there(stop).click(timeout=5000)
    page.wait(lambda s: len(s["orders"]) == 3)
    page.there("card-drone_2").evaluate("(card) => card.scrollIntoView({block: 'center'})")
    page.page.wait_for_timeout(300)
    free = "() => [document.querySelector('#shell').getBoundingClientRect().bottom, "
    free += "document.querySelector('.stops').getBoundingClientRect().top]"
    below_shell, above_stops = page.page.evaluate(free)
    assert above_stops - max(0, below_shell) >= 120
