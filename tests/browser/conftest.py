"""A page in the system's Chromium, in front of a console process, in front of a flight that nobody flies."""

import os
import shutil
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pytest

HERE = Path(__file__).parent
sys.path.insert(0, str(HERE))  # fake_flight and serve_fake are no tests, but theirs
FLAGS = [
    "--no-sandbox",
    "--disable-gpu",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
]
CHROMIUM = "/usr/bin/chromium"
WITHIN_S = 20.0


def eventually(condition: Callable[[], Any], within_s: float = WITHIN_S, what: str = "") -> Any:
    """Return the first true value of the condition; fails when none comes in time."""
    deadline = time.monotonic() + within_s
    while time.monotonic() < deadline:
        value = condition()
        if value:
            return value
        time.sleep(0.05)
    pytest.fail(f"not within {within_s:g} s: {what or condition}")


@dataclass
class Seen:
    """One page, and everything it did that it should not have done."""

    page: Any
    requests: list[str] = field(default_factory=list)
    troubles: list[str] = field(default_factory=list)

    def state(self) -> dict[str, Any]:
        # No wait_for_function: it evaluates a string in the page, which the content security policy forbids.
        return dict(self.page.evaluate("() => window.__console?.state ?? {}"))

    def wait(self, condition: Callable[[dict[str, Any]], Any], within_s: float = WITHIN_S) -> Any:
        deadline = time.monotonic() + within_s
        while time.monotonic() < deadline:
            state = self.state()
            if state and condition(state):
                return state
            self.page.wait_for_timeout(50)
        pytest.fail(f"the page did not come to this within {within_s:g} s")

    def there(self, testid: str) -> Any:
        return self.page.get_by_test_id(testid)

    def shot(self, name: str) -> None:
        folder = Path(os.environ.get("CONSOLE_SCREENSHOTS", "") or HERE.parents[1] / ".pytest_cache" / "screenshots")
        folder.mkdir(parents=True, exist_ok=True)
        self.page.screenshot(path=str(folder / f"{name}.png"), full_page=True)


@pytest.fixture(scope="session")
def browser() -> Iterator[Any]:
    if not shutil.which(CHROMIUM):
        pytest.skip(f"no Chromium at {CHROMIUM}: apt-get install chromium")
    playwright = pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
    with playwright.sync_playwright() as driver:
        launched = driver.chromium.launch(executable_path=CHROMIUM, args=FLAGS)
        yield launched
        launched.close()


class Stage:
    """A flight with its console, and pages in front of it."""

    def __init__(self, browser: Any) -> None:
        from fake_flight import FakeFlight, free_port

        self.browser = browser
        self.port = free_port()
        self.flight = FakeFlight()
        self.flight.start()
        self.console = self.start_console()
        self._contexts: list[Any] = []
        self.pages: list[Seen] = []

    @property
    def url(self) -> str:
        return f"http://127.0.0.1:{self.port}/"

    def start_console(self, truth: bool = True) -> "subprocess.Popen[bytes]":
        from serve_fake import start_console

        self.console = start_console(self.flight.endpoint, self.port, truth)
        return self.console

    def open(self, wait: bool = True, **options: Any) -> Seen:
        context = self.browser.new_context(viewport={"width": 1440, "height": 900}, **options)
        self._contexts.append(context)
        seen = Seen(context.new_page())
        seen.page.on("request", lambda request: seen.requests.append(request.url))
        seen.page.on("websocket", lambda socket: seen.requests.append(socket.url))
        seen.page.on("pageerror", lambda error: seen.troubles.append(f"error: {error}"))
        seen.page.on(
            "console", lambda line: seen.troubles.append(line.text) if line.type in ("error", "warning") else None
        )
        self.pages.append(seen)
        eventually(lambda: self._answers(seen), what="the console answers")
        if wait:
            seen.wait(lambda state: state["frames"] > 2 and state["trusted"])
        return seen

    def _answers(self, seen: Seen) -> bool:
        from playwright.sync_api import Error

        try:
            seen.page.goto(self.url)
        except Error:
            return False
        return True

    def close(self) -> None:
        for context in self._contexts:
            context.close()
        if self.console.poll() is None:
            self.console.terminate()
        self.console.wait(10)
        self.flight.stop()


@pytest.fixture
def stage(browser: Any) -> Iterator[Stage]:
    made = Stage(browser)
    yield made
    made.close()
