"""Commands that the buttons publish on the bus, and the page's texts about them."""

from typing import Any

import pytest

pytestmark = [pytest.mark.browser, pytest.mark.slow]


def verbs(stage: Any) -> list[str]:
    return [str(command.verb) for command in stage.flight.commands]


def test_land_all_is_one_click_and_is_shown_confirmed(stage: Any) -> None:
    page = stage.open()
    page.there("land-all").click()
    page.wait(lambda s: s["orders"] and s["orders"][0]["state"] == "confirmed")
    (command,) = stage.flight.commands
    assert (command.verb, command.scope, command.expires_ns) == ("LAND", (), 0)
    line = page.there("order").first
    assert "confirmed" in line.inner_text() and "drone_1 ✓ done" in line.inner_text().replace("\n", " ")
    page.wait(lambda s: page.there("drone_1-mode").inner_text() == "landed")
    page.shot("landed")


def test_keys_stop_too(stage: Any) -> None:
    page = stage.open()
    page.page.keyboard.press("h")
    page.wait(lambda s: verbs(stage) == ["HOLD"])
    page.page.keyboard.press("l")
    page.wait(lambda s: verbs(stage) == ["HOLD", "LAND"])
    cyrillic = "() => dispatchEvent(new KeyboardEvent('keydown', {key: 'д', code: 'KeyL'}))"
    page.page.evaluate(cyrillic)
    page.wait(lambda s: verbs(stage) == ["HOLD", "LAND", "LAND"])


def test_a_key_that_is_held_down_on_a_button_presses_it_once(stage: Any) -> None:
    page = stage.open()
    page.there("hold").focus()
    for _ in range(20):  # the first, and the keyboard's repetitions
        page.page.keyboard.down("Enter")
    page.page.keyboard.up("Enter")
    page.wait(lambda s: s["orders"] and s["orders"][0]["state"] == "confirmed")
    assert verbs(stage) == ["HOLD"]


def test_stops_stay_in_reach_while_the_help_is_open(stage: Any) -> None:
    page = stage.open()
    for size in ((1440, 900), (390, 844)):
        page.page.set_viewport_size({"width": size[0], "height": size[1]})
        page.page.keyboard.press("?")
        assert page.page.locator("#about").is_visible()
        page.there("land-all").click(timeout=5000)
        page.page.keyboard.press("Escape")
        assert page.page.locator("#about").is_hidden()
    page.wait(lambda s: verbs(stage) == ["LAND", "LAND"])


def test_an_order_that_nobody_answers_is_red_until_it_is(stage: Any) -> None:
    page = stage.open()
    stage.flight.deaf = {"drone_2"}
    page.there("land-all").click()
    page.page.wait_for_timeout(1500)
    line = page.there("order").first
    assert line.get_attribute("data-state") == "sent"
    assert "NOT CONFIRMED" in line.inner_text() and "drone_2 no answer" in line.inner_text().replace("\n", " ")
    alarm = page.there("banner-unheard")
    assert "LAND NOT CONFIRMED: no answer from drone_2" in alarm.inner_text()
    page.there("drone_1-hold").click()  # commands to drone_1 say nothing about drone_2
    page.wait(lambda s: s["orders"][0]["state"] == "confirmed")
    page.page.wait_for_timeout(1000)
    assert "LAND NOT CONFIRMED: no answer from drone_2" in alarm.inner_text()
    page.shot("not_confirmed")
    stage.flight.deaf = set()
    alarm.wait_for(state="detached", timeout=5000)


def test_one_drone_alone(stage: Any) -> None:
    page = stage.open()
    page.there("drone_2-land").click()
    page.wait(lambda s: s["orders"] and s["orders"][0]["state"] == "confirmed")
    (command,) = stage.flight.commands
    assert command.scope == ("drone_2",)


def test_cut_motors_wants_a_second_of_pressing(stage: Any) -> None:
    page = stage.open()
    page.there("cut-motors").click()
    page.page.wait_for_timeout(1300)
    assert verbs(stage) == []
    page.page.evaluate("() => { const wall = Date.now; setTimeout(() => { Date.now = () => wall() + 3.6e6; }, 300); }")
    page.there("cut-motors").click(delay=1600)  # the machine slept for an hour in the middle of it
    page.page.wait_for_timeout(300)
    assert verbs(stage) == []
    box = page.there("cut-motors").bounding_box()
    page.page.mouse.move(box["x"] + 20, box["y"] + 20)
    page.page.mouse.down()
    page.page.wait_for_timeout(1300)
    page.page.mouse.up()
    page.wait(lambda s: verbs(stage) == ["CUT_MOTORS"])
    page.there("cut-motors").focus()
    page.page.keyboard.down("Enter")
    page.page.wait_for_timeout(1300)
    page.page.keyboard.up("Enter")
    page.wait(lambda s: verbs(stage) == ["CUT_MOTORS", "CUT_MOTORS"])


def test_one_operator_at_a_time(stage: Any) -> None:
    stage.flight.modes = dict.fromkeys(stage.flight.modes, "LANDED")
    first, second = stage.open(), stage.open()
    for page in (first, second):
        page.slow_down(4)  # a start that takes two seconds, on a busy machine, is dropped
    first.there("take-off").click()
    first.wait(lambda s: verbs(stage) == ["TAKEOFF"])
    (command,) = stage.flight.commands
    assert command.scope[0] == "operator"  # starts need the lease
    second.page.wait_for_timeout(600)
    assert second.there("track").is_disabled()
    second.there("hold").click()  # anybody may stop
    second.wait(lambda s: verbs(stage) == ["TAKEOFF", "HOLD"])
    second.there("take-over").click()
    second.page.wait_for_timeout(600)
    assert "you may start" in second.there("operator").inner_text()
    assert first.there("track").is_disabled()
    stage.flight.modes = dict.fromkeys(stage.flight.modes, "HOVER")
    second.there("track").click()
    second.wait(lambda s: verbs(stage)[-1] == "TRACK")
    first.shot("taken_over")


def test_starts_need_the_main_process(stage: Any) -> None:
    page = stage.open()
    stage.flight.lease = False
    page.page.wait_for_timeout(2500)
    assert page.there("take-off").is_disabled()
    assert page.there("land-all").is_enabled()


def test_the_simulated_target_is_driven_and_dragged(stage: Any) -> None:
    page = stage.open()
    page.there("map").focus()
    page.page.keyboard.down("ArrowUp")
    page.page.wait_for_timeout(400)
    page.page.keyboard.up("ArrowUp")
    page.wait(lambda s: stage.flight.steered and stage.flight.steered[-1].speed_m_s == 0.0)
    assert any(order.action == "drive" and order.speed_m_s > 0 for order in stage.flight.steered)
    box = page.there("map").bounding_box()
    x, y = page.state()["points"]["turtlebot"]
    page.page.mouse.move(box["x"] + x, box["y"] + y)
    page.page.mouse.down()
    page.page.mouse.move(box["x"] + box["width"] / 2, box["y"] + box["height"] / 2, steps=5)
    page.page.mouse.up()
    page.wait(lambda s: max(map(abs, stage.flight.steered[-1].position_m or (9.0,))) < 0.1)
    assert stage.flight.steered[-1].action == "place"


def test_a_real_target_is_not_steered(stage: Any) -> None:
    stage.console.terminate()
    stage.console.wait(10)
    stage.start_console(truth=False)
    page = stage.open()
    page.there("map").focus()
    page.page.keyboard.press("ArrowUp")
    page.page.evaluate("() => 0")
    page.page.wait_for_timeout(500)
    assert stage.flight.steered == []
    assert page.page.locator("[data-testid=layer-truth]").count() == 0


def test_answers_that_were_lost_are_given_again(stage: Any) -> None:
    page = stage.open()
    stage.flight.deaf = {"drone_1", "drone_2"}
    page.there("land-all").click()
    page.wait(lambda s: verbs(stage) == ["LAND"])
    page.page.wait_for_timeout(800)
    assert page.state()["orders"][0]["state"] == "sent"
    stage.flight.deaf = set()
    page.wait(lambda s: s["orders"][0]["state"] == "confirmed")
    assert verbs(stage) == ["LAND"]  # repeated, but one command


def test_a_device_that_may_only_stop_has_stops_and_says_why_it_cannot_start(stage: Any) -> None:
    page = stage.open(role="stop")
    for start in ("take-off", "track", "resume"):
        assert page.there(start).is_disabled()
        assert page.there(start).get_attribute("title") == "this device may stop only"
    page.there("hold").click()
    page.wait(lambda s: verbs(stage) == ["HOLD"])


def test_a_device_that_may_only_watch_has_no_enabled_button(stage: Any) -> None:
    page = stage.open(role="watch")
    for button in ("take-off", "track", "resume", "hold", "land-all", "cut-motors", "drone_2-land"):
        assert page.there(button).is_disabled(), button
    assert page.there("land-all").get_attribute("title") == "this device may watch only"
    page.page.keyboard.press("l")
    page.wait(lambda s: page.there("order").count() and "may watch only" in page.there("order").first.inner_text())
    assert verbs(stage) == []
