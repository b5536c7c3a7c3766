"""A page whose process freezes in flight and resumes: its display, and the clicks made meanwhile."""

import json
import os
import shutil
import signal
import time
import urllib.request
from collections.abc import Iterator
from typing import Any

import pytest
from conftest import CHROMIUM, FLAGS, Stage
from free_port import free_port

pytestmark = [pytest.mark.browser, pytest.mark.slow]

# Longer than an unanswered stop is shown: it counts from when the page learnt what became of it.
FROZEN_S = 35.0


class DevTools:
    """A browser's debugging port; requests do not wait for answers, since a frozen page gives none."""

    def __init__(self, port: int) -> None:
        self._port = port

    def socket(self, kind: str) -> Any:
        client = pytest.importorskip("websockets.sync.client")
        with urllib.request.urlopen(f"http://127.0.0.1:{self._port}/json/{kind}", timeout=5) as answer:
            told = json.load(answer)
        pages = [each for each in told if each["type"] == "page"] if kind == "list" else [told]
        return client.connect(pages[0]["webSocketDebuggerUrl"])

    def renderers(self) -> list[int]:
        with self.socket("version") as browser:
            browser.send(json.dumps({"id": 1, "method": "SystemInfo.getProcessInfo"}))
            told = json.loads(browser.recv(5))["result"]["processInfo"]
        return [each["id"] for each in told if each["type"] == "renderer"]


def press(page: Any, box: dict[str, float]) -> None:
    at = {"x": box["x"] + box["width"] / 2, "y": box["y"] + 12, "button": "left", "clickCount": 1}
    for number, kind in enumerate(("mousePressed", "mouseReleased")):
        page.send(json.dumps({"id": number, "method": "Input.dispatchMouseEvent", "params": {"type": kind, **at}}))


@pytest.fixture
def watched() -> Iterator[tuple[Stage, DevTools]]:
    playwright = pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
    if not shutil.which(CHROMIUM):
        pytest.skip(f"no Chromium at {CHROMIUM}: apt-get install chromium")
    port = free_port()
    with playwright.sync_playwright() as driver:
        flags = [*FLAGS, f"--remote-debugging-port={port}"]
        browser = driver.chromium.launch(executable_path=CHROMIUM, args=flags)
        stage = Stage(browser)
        yield stage, DevTools(port)
        stage.close()
        browser.close()


def test_clicks_on_a_frozen_page_give_no_commands_after_it_resumes(watched: tuple[Stage, DevTools]) -> None:
    stage, tools = watched
    stage.flight.modes["drone_1"] = "HOLD"
    page = stage.open()
    page.wait(lambda s: page.there("resume").is_enabled())
    places = [page.there(name).bounding_box() for name in ("resume", "drone_2-land")]
    stopped = tools.renderers()
    with tools.socket("list") as hand:
        try:
            for pid in stopped:
                os.kill(pid, signal.SIGSTOP)
            for place in places:
                press(hand, place)
            time.sleep(FROZEN_S)
        finally:
            for pid in stopped:
                os.kill(pid, signal.SIGCONT)
    orders, banner = page.there("orders"), page.there("banner-unheard")
    page.wait(lambda s: s["connected"] and orders.inner_text().count("came too late") == 2, within_s=10)
    page.wait(lambda s: "LAND REFUSED: not given to drone_2" in banner.inner_text(), within_s=5)
    page.shot("frozen_page_goes_on")
    assert stage.flight.commands == []
    page.wait(
        lambda s: s["estimateAge"] < 500 and page.there("drone_1-heard").inner_text().startswith("0."), within_s=5
    )
    page.page.wait_for_timeout(1000)  # clicks from now on are new
    page.there("land-all").click()
    page.wait(lambda s: any(order["state"] == "confirmed" for order in s["orders"]))
    assert [command.verb for command in stage.flight.commands] == ["LAND"]
