"""A page under observation: its content, its network requests and its errors."""

import os
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pytest

HERE = Path(__file__).parent
WITHIN_S = 20.0
# A process that starts beside flights, at the pages' low priority.
STARTED_WITHIN_S = 60.0


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
    """One page, and a record of everything that went wrong in it."""

    page: Any
    requests: list[str] = field(default_factory=list)
    troubles: list[str] = field(default_factory=list)

    def state(self) -> dict[str, Any]:
        # Not wait_for_function: it evaluates a string in the page, which the content security policy forbids.
        return dict(self.page.evaluate("() => window.__console?.state ?? {}"))

    def wait(self, condition: Callable[[dict[str, Any]], Any], within_s: float = WITHIN_S) -> Any:
        deadline = time.monotonic() + within_s
        while time.monotonic() < deadline:
            state = self.state()
            if state and condition(state):
                return state
            self.page.wait_for_timeout(50)
        pytest.fail(f"the page did not come to this within {within_s:g} s")

    def slow_down(self, times: int) -> None:
        """Slow the page's clocks, because the computer may need long for an event that the page waits for."""
        self.page.evaluate(
            """(times) => { for (const clock of [performance, Date]) {
                const now = clock.now.bind(clock), start = now();
                clock.now = () => start + (now() - start) / times; } }""",
            times,
        )

    def there(self, testid: str) -> Any:
        return self.page.get_by_test_id(testid)

    def shots(self) -> Path:
        folder = Path(os.environ.get("CONSOLE_SCREENSHOTS", "") or HERE.parents[1] / ".pytest_cache" / "screenshots")
        folder.mkdir(parents=True, exist_ok=True)
        return folder

    def shot(self, name: str) -> None:
        self.page.screenshot(path=str(self.shots() / f"{name}.png"), full_page=True)


def give_role(context: Any, role: str) -> None:
    """Change the role in the server's welcome, as for an invited device."""

    def between(page: Any) -> None:
        server = page.connect_to_server()
        page.on_message(server.send)
        server.on_message(
            lambda text: page.send(
                text.replace('"role":"command"', f'"role":"{role}"') if isinstance(text, str) else text
            )
        )

    context.route_web_socket("**/ws", between)


def open_seen(browser: Any, contexts: list[Any], url: str, role: str = "", script: str = "", **options: Any) -> Seen:
    """Open a page with its own profile; return it once it has its first frames. The script runs before the page's."""
    from playwright.sync_api import Error

    context = browser.new_context(**{"viewport": {"width": 1440, "height": 900}} | options)
    contexts.append(context)
    if role:
        give_role(context, role)
    if script:
        context.add_init_script(script)
    seen = Seen(context.new_page())
    seen.page.on("request", lambda request: seen.requests.append(request.url))
    seen.page.on("websocket", lambda socket: seen.requests.append(socket.url))
    seen.page.on("pageerror", lambda error: seen.troubles.append(f"error: {error}"))
    seen.page.on("console", lambda line: seen.troubles.append(line.text) if line.type in ("error", "warning") else None)

    def answers() -> bool:
        try:
            seen.page.goto(url)
        except Error:
            return False
        return True

    eventually(answers, STARTED_WITHIN_S, "the console answers")
    seen.wait(lambda state: state["frames"] > 2 and state["trusted"])
    return seen
