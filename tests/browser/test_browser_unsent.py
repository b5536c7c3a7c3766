"""A stop given without a connection belongs to one run and expires after 5 s."""

import signal
from typing import Any

import pytest
from seen_page import STARTED_WITHIN_S, Seen, eventually

pytestmark = [pytest.mark.browser, pytest.mark.slow]


def cut_off(stage: Any, run: str) -> Seen:
    """Return a page without a connection; a console of the run named waits for it at the same port."""
    page: Seen = stage.open()
    stage.console.kill()
    stage.console.wait(5)
    page.there("banner-link").wait_for(timeout=20_000)
    page.page.context.set_offline(True)
    stage.start_console(run=run)
    eventually(stage.answers, STARTED_WITHIN_S, "the next console answers")
    return page


def hold_cut_motors(page: Seen) -> None:
    box = page.there("cut-motors").bounding_box()
    page.page.mouse.move(box["x"] + 20, box["y"] + 20)
    page.page.mouse.down()
    page.page.wait_for_timeout(1300)
    page.page.mouse.up()


def reconnect(page: Seen) -> dict[str, Any]:
    """Return the state of the page once it had time to send everything that it will send."""
    page.page.context.set_offline(False)
    page.wait(lambda s: s["connected"] and s["seeds"] == 2 and s["trusted"])
    page.page.wait_for_timeout(1500)
    return page.state()


def test_a_stop_goes_out_to_a_restarted_console_of_the_same_run(stage: Any) -> None:
    page = cut_off(stage, run="run-1")
    page.there("land-all").click()
    assert "NOT SENT" in page.there("orders").inner_text()
    page.page.context.set_offline(False)
    page.wait(lambda s: any(order["state"] == "confirmed" for order in s["orders"]))
    assert [command.verb for command in stage.flight.commands] == ["LAND"]


def test_a_stop_that_was_lost_with_its_console_goes_out_to_the_next_one(stage: Any) -> None:
    page: Seen = stage.open()
    page.slow_down(6)  # a stop lives for 5 s, in which the next console may not be there yet
    stage.console.send_signal(signal.SIGSTOP)  # it accepts the page's messages, and does nothing with them
    page.there("land-all").click()
    page.page.wait_for_timeout(200)
    stage.console.kill()
    stage.console.wait(5)
    page.there("banner-link").wait_for(timeout=20_000)
    assert "the connection broke" in page.there("orders").inner_text()
    stage.start_console()
    page.wait(lambda s: any(order["state"] == "confirmed" for order in s["orders"]), STARTED_WITHIN_S)
    assert [command.verb for command in stage.flight.commands] == ["LAND"]


def test_a_stop_never_goes_to_the_next_run(stage: Any) -> None:
    page = cut_off(stage, run="run-2")
    hold_cut_motors(page)
    page.there("land-all").click()
    assert "NOT SENT" in page.there("orders").inner_text()
    state = reconnect(page)
    assert stage.flight.commands == [] and state["orders"] == []
    assert page.there("orders").inner_text().count("for another run") == 2
    page.shot("stop_of_another_run")
    page.there("land-all").click()  # stops from now on are for the run that the page shows
    page.wait(lambda s: [command.verb for command in stage.flight.commands] == ["LAND"])


def test_cut_motors_held_while_the_next_run_appears_does_not_cut_it(stage: Any) -> None:
    page = cut_off(stage, run="run-2")
    # The next press lasts for longer than the page needs to connect; by the page's clocks it is a second.
    page.page.evaluate("""() => {
        const later = setTimeout;
        window.setTimeout = (f, ms, ...rest) => later(f, ms === 1000 ? 6000 : ms, ...rest);
    }""")
    page.slow_down(6)
    box = page.there("cut-motors").bounding_box()
    page.page.mouse.move(box["x"] + 20, box["y"] + 20)
    page.page.mouse.down()
    reconnect(page)
    page.page.wait_for_timeout(6000)
    page.page.mouse.up()
    assert stage.flight.commands == []
    assert "for another run" in page.there("orders").inner_text()


@pytest.mark.parametrize(
    "asleep", [pytest.param(False, id="awake"), pytest.param(True, id="asleep", marks=pytest.mark.exhaustive)]
)
def test_a_stop_lives_for_five_seconds(stage: Any, asleep: bool) -> None:
    page = cut_off(stage, run="run-1")
    page.there("land-all").click()
    if asleep:  # performance.now() stands still, and no script runs
        page.page.evaluate("() => { const wall = Date.now; Date.now = () => wall() + 6000; }")
    else:
        page.page.wait_for_timeout(5500)
    state = reconnect(page)
    assert stage.flight.commands == [] and state["orders"] == []
    assert "no connection for 5 s" in page.there("orders").inner_text()
    assert "LAND NOT SENT: not given to drone_1, drone_2" in page.there("banner-unheard").inner_text()
    assert page.there("safety").inner_text() == "ACT"
