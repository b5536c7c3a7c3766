"""One test for each check of the kit; collected by its pytest plug-in, see `plugin.py`."""

import pytest

from groundstation.errors import SettingsError
from sim_bridge.conformance.check import Check
from sim_bridge.conformance.kit import Kit, chosen


def pytest_generate_tests(metafunc: pytest.Metafunc) -> None:
    """Make a test of each check, those of one flight together."""
    try:
        checks = chosen(metafunc.config.getoption("--skein-only"))
    except SettingsError as error:
        raise pytest.UsageError("\n".join(error.problems).replace("--only", "--skein-only")) from None
    metafunc.parametrize("check", checks, ids=[one.name for one in checks])


@pytest.fixture(scope="session")
def kit(request: pytest.FixtureRequest) -> Kit:
    """Return the judge of the kind that was asked for."""
    name = request.config.getoption("--skein-vehicle")
    if not name:
        pytest.skip("no kind is named: pytest --skein-vehicle NAME")
    return Kit(name, request.config.getoption("--skein-with"), request.config.getoption("--skein-damaged"))


def test_vehicle(kit: Kit, check: Check) -> None:
    """The kind passes the check."""
    verdict = kit.judge(check)
    if verdict.end == "does not apply":
        pytest.skip(verdict.why)
    if verdict.end == "failed":
        pytest.fail(f"{check.text}: {verdict.why}", pytrace=False)
