"""A page in the system's Chromium, with a console process and a fake flight behind it."""

import shutil
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

sys.path.insert(0, str(Path(__file__).parent))  # for the helper modules of this folder
from fake_flight import FakeFlight
from free_port import free_port as any_port
from real_flight import answers, kernels, live, served  # noqa: F401
from seen_page import Seen, open_seen
from serve_fake import many_drones, start_console

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


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    # Not for the whole session: playwright keeps an event loop running in this thread, and other tests want their own.
    if not shutil.which(CHROMIUM):
        pytest.skip(f"no Chromium at {CHROMIUM}: apt-get install chromium")
    playwright = pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
    with playwright.sync_playwright() as driver:
        launched = driver.chromium.launch(executable_path=CHROMIUM, args=FLAGS)
        yield launched
        launched.close()


class Stage:
    """A flight with its console, and pages that show it."""

    def __init__(
        self, browser: Any, flight: FakeFlight | None = None, field: str = "lab", sets: list[str] | None = None
    ) -> None:
        self.browser, self.flight, self.field, self.sets = browser, flight or FakeFlight(), field, sets
        self.port = any_port()
        self.flight.start()
        self.console = self.start_console()
        self._contexts: list[Any] = []
        self.pages: list[Seen] = []

    @property
    def url(self) -> str:
        return f"http://127.0.0.1:{self.port}/"

    def start_console(self, truth: bool = True, run: str = "run-1") -> "subprocess.Popen[bytes]":
        self.console = start_console(self.flight.endpoint, self.port, truth, field=self.field, run=run, sets=self.sets)
        return self.console

    def answers(self) -> bool:
        """Return whether a console serves at the port."""
        return answers(self.url)

    def open(self, **options: Any) -> Seen:
        seen = open_seen(self.browser, self._contexts, self.url, **options)
        self.pages.append(seen)
        return seen

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


@pytest.fixture
def mixed_stage(browser: Any) -> Iterator[Stage]:
    """Three drones of three kinds and two ceiling cameras."""
    drones, cameras = ("drone_1", "drone_2", "drone_3"), ("ceiling_west", "ceiling_east")
    made = Stage(browser, FakeFlight(drones, cameras), "mixed-team")
    yield made
    made.close()


@pytest.fixture
def large_stage(browser: Any) -> Iterator[Stage]:
    """Eight drones: two more than there are colours."""
    drones = tuple(f"drone_{number}" for number in range(1, 9))
    flight = FakeFlight(drones)
    flight.battery = dict.fromkeys(drones, 0.71)
    made = Stage(browser, flight, sets=many_drones(drones))
    yield made
    made.close()


@pytest.fixture
def free_port() -> int:
    return any_port()


@pytest.fixture
def open_page(browser: Any) -> Iterator[Callable[..., Seen]]:
    contexts: list[Any] = []
    yield lambda url, **options: open_seen(browser, contexts, url, **options)
    for context in contexts:
        context.close()
