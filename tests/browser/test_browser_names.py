"""Names that are hard on a page: long ones, and one that every JavaScript object has."""

import shutil
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from clipping import clipped, covered
from conftest import Stage
from fake_flight import FakeFlight
from fonts import REMEMBER, small
from on_demand import on_demand
from seen_page import Seen

from groundstation.bus.messages import Severity

pytestmark = [pytest.mark.browser, pytest.mark.slow]

CONFIG = Path(__file__).parents[2] / "config"
LONG = "the_longest_name_that_a_drone_may_have_in"  # 41 letters; its camera has the same name with _camera
SIZES = [(390, 844), (1440, 900), *on_demand([(1024, 768), (2560, 1440)])]


@pytest.fixture
def named(browser: Any, tmp_path: Path) -> Iterator[Callable[..., Stage]]:
    """Stages of a field with another name for drone_1; `heard`: the drones with telemetry."""
    made = []
    shutil.copytree(CONFIG / "cameras", tmp_path / "cameras")

    def make(name: str, heard: tuple[str, ...]) -> Stage:
        (tmp_path / "named.yaml").write_text((CONFIG / "lab.yaml").read_text().replace("drone_1", name))
        made.append(Stage(browser, FakeFlight(heard), str(tmp_path / "named")))
        return made[-1]

    yield make
    for stage in made:
        stage.close()


def test_a_drone_that_is_not_heard_may_be_called_as_every_object_has_something_called(named: Any) -> None:
    page = named("constructor", ("drone_2",)).open()
    page.wait(lambda s: page.there("drone_2-mode").inner_text() == "track")
    assert page.there("constructor-mode").inner_text() == "no word yet"
    assert page.there("constructor-heard").inner_text() == "never"
    assert page.there("team-mode").inner_text() == "TRACK"
    assert page.troubles == []


@pytest.mark.parametrize("size", SIZES, ids=str)
def test_no_text_is_cut_off_where_names_are_long(named: Any, size: tuple[int, int]) -> None:
    stage = named(LONG, (LONG, "drone_2"))
    flight: FakeFlight = stage.flight
    page: Seen = stage.open(script=REMEMBER)
    page.page.set_viewport_size({"width": size[0], "height": size[1]})
    page.page.wait_for_timeout(700)
    assert wrong(page) == []
    flight.event(Severity.ERROR, "trouble that takes some words to tell", LONG)
    flight.modes["drone_2"], flight.battery[LONG] = "HOLD", 0.17
    flight.lands_in_s[LONG], flight.detail[LONG] = 12.0, "not seen by any camera for too long"
    page.there(f"{LONG}-land").click()
    page.wait(lambda s: s["orders"])
    page.page.wait_for_timeout(700)
    page.shot(f"long_name_{size[0]}")
    assert LONG not in page.there("verdict").inner_text() and LONG in page.there("orders").inner_text()
    # An alarm longer than its strip opens over the page, as any other.
    assert [words for words in wrong(page) if not words.startswith("banners")] == []


def wrong(page: Seen) -> list[str]:
    """Return the texts that are clipped, covered, too small, or wider than the window."""
    wide = page.page.evaluate("() => document.documentElement.scrollWidth > innerWidth ? ['wide'] : []")
    return [*clipped(page.page), *covered(page.page), *small(page.page), *wide]
