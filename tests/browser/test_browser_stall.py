"""A stalled connection is reopened within seconds, and a stop given meanwhile is sent; a slow one is named."""

import time
from collections.abc import Iterator
from typing import Any

import pytest
from layout import resize, whole
from seen_page import eventually
from situations import SITUATIONS
from stalling_pipe import StallingPipe

pytestmark = [pytest.mark.browser, pytest.mark.slow]


@pytest.fixture
def pipe(stage: Any) -> Iterator[StallingPipe]:
    eventually(stage.answers, what="the console answers")
    made = StallingPipe(stage.port)
    yield made
    made.close()


def test_a_connection_that_stalls_is_opened_again_and_a_stop_given_meanwhile_goes_out(
    stage: Any, pipe: StallingPipe, open_page: Any
) -> None:
    page = open_page(pipe.url)
    pipe.stalled.set()
    page.there("banner-silent").wait_for(timeout=20_000)
    page.there("land-all").click()
    page.page.wait_for_timeout(500)
    assert stage.flight.commands == []
    pipe.stalled.clear()  # the network is back; stalled connections stay dead
    page.wait(lambda s: s["seeds"] == 2 and any(order["state"] == "confirmed" for order in s["orders"]))
    assert [command.verb for command in stage.flight.commands] == ["LAND"]


def test_a_connection_is_tried_for_no_longer_than_some_seconds(pipe: StallingPipe, open_page: Any) -> None:
    """The waits for token and connection are both limited."""
    page = open_page(pipe.url)
    pipe.stalled.set()
    page.there("banner-link").wait_for(timeout=20_000)
    page.page.wait_for_timeout(1500)  # it requests the token by now, and gets no answer
    pipe.stalled.clear()
    page.wait(lambda s: s["seeds"] == 2 and s["trusted"])
    before = page.state()["frames"]
    page.page.wait_for_timeout(4000)
    assert page.state()["seeds"] == 2 and page.state()["frames"] > before  # a good one is left alone


def test_a_link_that_delays_what_comes_is_named_and_passes_stops_on(
    stage: Any, pipe: StallingPipe, open_page: Any
) -> None:
    page = open_page(pipe.url)
    SITUATIONS["all_is_well"](stage.flight)
    page.wait(lambda s: page.there("safety").inner_text() == "SAFE")
    pipe.late_s = 6.0
    page.there("banner-slow").wait_for(timeout=60_000)
    page.page.wait_for_timeout(10_000)
    began = time.monotonic()
    page.page.keyboard.press("h")
    eventually(lambda: [command.verb for command in stage.flight.commands] == ["HOLD"], what="HOLD reaches the drones")
    assert time.monotonic() - began < 2.0
    assert page.there("safety").inner_text() == "ACT" and page.there("link").inner_text() == "slow link"
    assert page.state()["estimateAge"] > 5.9
    assert "SLOW LINK: what you see is" in page.there("banners").inner_text()
    assert "silent" not in page.there("drone_1-mode").inner_text() and "stale" in page.there(
        "card-drone_1"
    ).get_attribute("class")
    page.shot("slow_link")
    for size in ((1440, 900), (390, 844)):
        resize(page, size)
        assert whole(page) == [], size
    page.shot("slow_link_phone")
    page.wait(lambda s: any(order["state"] == "confirmed" for order in s["orders"]))
    assert [command.verb for command in stage.flight.commands] == ["HOLD"]
    assert "too late" not in page.there("orders").inner_text()
