"""Shared by all tests: coverage, the kernel cache of these sources, shipped settings, and recorded data."""

import gc
import os
import signal
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import NoReturn

import pytest

from measurement import Measurement

MEASUREMENT = Measurement()

from groundstation.process.one_thread import stay_on_one_thread

stay_on_one_thread()

from groundstation.field.resolved import ResolvedField
from groundstation.process import child, numba_cache

numba_cache.activate(numba_cache.EVERYTHING)
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    # A suite in the background inherits this, and would hand it on to the commands that its tests interrupt.
    signal.signal(signal.SIGINT, signal.default_int_handler)

# Nothing that is imported and collected becomes garbage: a tenth of the time of collecting, without this.
gc.disable()

ROOT = Path(__file__).parents[1]
CONFIG = ROOT / "config"
BESIDE_FLIGHTS = {
    "browser": "page",
    "calibration": "study",
    "property": "study",
    "replay": "study",
    "statistics": "study",
}


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Mark the slow tests in folders whose tests fly nothing in real time."""
    for item in items:
        for folder in set(item.path.relative_to(ROOT).parts) & set(BESIDE_FLIGHTS):
            if item.get_closest_marker("slow"):
                item.add_marker(BESIDE_FLIGHTS[folder])


def pytest_collection_finish() -> None:
    """Leave all modules and tests out of the later collections of garbage."""
    gc.freeze()
    gc.enable()


def pytest_sessionfinish(session: pytest.Session, exitstatus: int) -> None:
    """Let a repetition without failed tests pass."""
    nothing_to_repeat = session.config.getoption("last_failed_no_failures", "all") == "none"
    if exitstatus == pytest.ExitCode.NO_TESTS_COLLECTED and nothing_to_repeat:
        session.exitstatus = pytest.ExitCode.OK
    reporter = session.config.pluginmanager.get_plugin("terminalreporter")
    skipped = len(reporter.stats.get("skipped", ())) if reporter else 0
    MEASUREMENT.finish(skipped, repeated=bool(session.config.getoption("lf", False)))


@pytest.fixture(scope="session", autouse=True)
def own_share() -> Iterator[None]:
    """Keep pytest's processor share: children that run inside pytest must not change it."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(child, "take_share", lambda _nice: False)
        yield


@pytest.fixture(scope="session")
def lab_field() -> ResolvedField:
    """The shipped field."""
    from groundstation.settings.load import load_field
    from groundstation.settings.resolved import resolved_field

    return resolved_field(load_field(CONFIG / "lab.yaml"))


def _absent(reason: str) -> NoReturn:
    if os.environ.get("CI"):
        pytest.fail(reason, pytrace=False)
    pytest.skip(reason)


@pytest.fixture(scope="session")
def absent() -> Callable[[str], NoReturn]:
    """End a test that this machine cannot run: skipped with the reason, but failed where CI is set."""
    return _absent


@pytest.fixture(scope="session")
def real_data() -> Callable[[str], Path]:
    """Return the path of real data by its name in $GROUNDSTATION_DATA, else in ../shared/data."""
    folder = Path(os.environ.get("GROUNDSTATION_DATA") or ROOT.parent / "shared" / "data")

    def find(name: str) -> Path:
        path = folder / name
        if not path.exists():
            _absent(f"no {path}: real data are not in the repository; let GROUNDSTATION_DATA name their folder")
        return path

    return find


@pytest.fixture(scope="session")
def golden_packet() -> Callable[[str], bytes]:
    """Return a packet assembled by hand, by its name in tests/fixtures/ardrone."""

    def read(name: str) -> bytes:
        text = (ROOT / "tests" / "fixtures" / "ardrone" / f"{name}.hex").read_text(encoding="utf-8")
        return bytes.fromhex("".join(line.partition("#")[0] for line in text.splitlines()))

    return read
