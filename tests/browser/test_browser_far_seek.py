"""Time from the key that jumps to the other end of a recording to the picture of that moment."""

import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from conftest import Stage
from recorded_flight import record
from seen_page import Seen

pytestmark = [pytest.mark.browser, pytest.mark.slow, pytest.mark.exhaustive, pytest.mark.timeout(300)]

_RECORDED_S, _JUMPS, _LIMIT_MS = 80.0, 30, 200.0
# The page's own time from a key press to the first picture after the jump [ms].
_JUMP = """(key) => new Promise((done) => {
    const before = window.__console.state, began = performance.now();
    dispatchEvent(new KeyboardEvent("keydown", {key}));
    const look = () => {
      const now = window.__console.state;
      if (now.seeds > before.seeds && now.draws > before.draws) done(performance.now() - began);
      else requestAnimationFrame(look);
    };
    requestAnimationFrame(look); })"""


@pytest.fixture
def recording(browser: Any, tmp_path: Path) -> Path:
    stage = Stage(browser)
    try:
        return record(stage.flight, stage.open(), tmp_path, _RECORDED_S).folder
    finally:
        stage.close()


def test_a_far_seek_is_drawn_within_a_fifth_of_a_second(
    recording: Path, free_port: int, open_page: Any, record_property: Callable[[str, object], None]
) -> None:
    command = [sys.executable, "-m", "groundstation", "replay", str(recording), "--port", str(free_port), "--paused"]
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL)
    try:
        page: Seen = open_page(f"http://127.0.0.1:{free_port}/")
        delays: list[float] = []
        for jump in range(_JUMPS):
            delays.append(page.page.evaluate(_JUMP, ("End", "Home")[jump % 2]))
            page.page.wait_for_timeout(300)
    finally:
        process.terminate()
        process.wait(10)
    delays.sort()
    figures = f"median {delays[_JUMPS // 2]:.0f} ms, worst of {_JUMPS} {delays[-1]:.0f} ms"
    record_property("far seek", figures)
    print(figures)
    assert delays[-1] <= _LIMIT_MS, figures
