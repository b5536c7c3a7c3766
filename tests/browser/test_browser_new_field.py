"""The page of `groundstation new --page` draws the field during input, names mistakes, and writes the file once."""

import signal
import subprocess
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import pytest
from accessibility import violations
from new_field_form import new_field_form

from groundstation.settings.load import load_field

pytestmark = [pytest.mark.browser, pytest.mark.slow]


class Form(NamedTuple):
    page: Any
    command: "subprocess.Popen[str]"
    field: Path


@pytest.fixture
def form(browser: Any, tmp_path: Path) -> Iterator[Form]:
    context = browser.new_context(viewport={"width": 1440, "height": 900})
    page = context.new_page()
    with new_field_form(tmp_path / "hall") as (process, url):
        page.goto(url)
        yield Form(page, process, tmp_path / "hall" / "hall.yaml")
        context.close()


def drawn(page: Any) -> str:
    """Return the address of the drawing once the button may be pressed."""
    page.locator("#write:enabled").wait_for(timeout=20_000)
    return str(page.locator("#room").get_attribute("src"))


def test_the_room_is_drawn_while_one_answers_and_written_by_the_button(form: Form) -> None:
    first = drawn(form.page)
    form.page.locator("[name=count]").fill("4")
    form.page.locator("[name=base]").select_option("rc_car")
    assert drawn(form.page) != first
    form.page.locator("[name=room_height]").fill("3.0")
    form.page.locator("#note[data-level=bad]").wait_for(timeout=20_000)
    assert "room for 2 pads, not for 4" in form.page.locator("#note").inner_text()
    assert form.page.locator("#write").is_disabled() and not form.field.exists()
    form.page.locator("[name=room_height]").fill("5")
    drawn(form.page)
    assert violations(form.page) == []
    form.page.locator("#write").click()
    form.page.get_by_text("Written:").wait_for(timeout=20_000)
    said, _ = form.command.communicate(timeout=20)
    assert form.command.returncode == 0 and "groundstation config check" in said
    field = load_field(form.field)
    assert len(field.drones) == 4 and field.tracked["rc_car"].marker.height_m == 0.2 and field.room.size_m[2] == 5.0


def test_ctrl_c_writes_nothing_and_the_page_says_so(form: Form) -> None:
    drawn(form.page)
    form.command.send_signal(signal.SIGINT)
    form.page.get_by_text("nothing was written").wait_for(timeout=10_000)
    assert form.command.wait(10) == 2 and not form.field.parent.exists()
