"""Lighthouse gives the console, the wall view and the new-field form 100 points for accessibility."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import pytest
from conftest import CHROMIUM, FLAGS
from lighthouse import accessibility
from new_field_form import new_field_form

pytestmark = [pytest.mark.browser, pytest.mark.slow]


class Debugged(NamedTuple):
    """A page of a browser whose debugging port and profile Lighthouse can use."""

    page: Any
    port: int


@pytest.fixture
def debugged(browser: Any, tmp_path: Path, free_port: int) -> Iterator[Debugged]:
    flags = [*FLAGS, f"--remote-debugging-port={free_port}"]
    launch = browser.browser_type.launch_persistent_context
    context = launch(str(tmp_path / "profile"), executable_path=CHROMIUM, args=flags)
    yield Debugged(context.pages[0], free_port)
    context.close()


@pytest.mark.parametrize("wall", [pytest.param(False, marks=pytest.mark.exhaustive), True])
def test_the_console_and_the_wall(stage: Any, debugged: Debugged, wall: bool) -> None:
    stage.open()
    debugged.page.goto(stage.url)
    debugged.page.evaluate("(on) => localStorage.setItem('skein-wall', on ? '1' : '')", wall)
    debugged.page.reload()
    assert debugged.page.evaluate("() => document.body.classList.contains('wall')") is wall
    assert accessibility(stage.url, debugged.port) == (1.0, [])


def test_the_form_of_a_new_field(debugged: Debugged, tmp_path: Path) -> None:
    with new_field_form(tmp_path / "hall") as (_, url):
        assert accessibility(url, debugged.port) == (1.0, [])
