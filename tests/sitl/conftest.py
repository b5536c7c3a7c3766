"""Runs of `groundstation sitl` that end with the test, and taps on the drones' command ports."""

import itertools
import sys
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))  # for the helper modules of this folder
from sitl_run import COMMAND, SitlRun
from wire_tap import WireTap


@pytest.fixture
def sitl(tmp_path: Path) -> Iterator[Callable[..., SitlRun]]:
    """Start a run: `sitl("--duration", "10")`; its field is the lab unless the first argument names a verb.

    Each is closed whatever becomes of the others: one that kept flying would take the processor from all later tests.
    """
    count, runs = itertools.count(), ExitStack()

    def start(*arguments: str, terminal: int | None = None, program: tuple[str, ...] = COMMAND) -> SitlRun:
        folder = tmp_path / f"run{next(count)}"
        folder.mkdir()
        verb = arguments if arguments[:1] in (("demo",), ("sitl",)) else ("sitl", "lab", *arguments)
        run = SitlRun(folder, *verb, terminal=terminal, program=program)
        runs.callback(run.close)
        return run

    with runs:
        yield start


@pytest.fixture
def tap() -> Iterator[WireTap]:
    """Record the datagrams to the drones' command ports."""
    try:
        made = WireTap()
    except PermissionError:
        pytest.skip("listening to the loopback interface needs CAP_NET_RAW")
    yield made
    made.close()
