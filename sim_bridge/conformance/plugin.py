"""The kit as a pytest plug-in: `pytest --skein-vehicle NAME` makes a test of each check.

Every pytest of an environment loads it, so nothing of the simulator is imported before the kit is asked for.
"""

from pathlib import Path

import pytest

TESTS = Path(__file__).with_name("vehicle_tests.py")


def pytest_addoption(parser: pytest.Parser) -> None:
    """Add the kit's options."""
    group = parser.getgroup("skein", "conformance of a kind of vehicle")
    group.addoption("--skein-vehicle", metavar="NAME", help="Judge this kind of vehicle against the driver's contract.")
    group.addoption("--skein-with", action="append", default=[], metavar="SECTION.KEY=VALUE",
                    help="A key of the vehicle's own section of the field file; repeatable.")  # fmt: skip
    group.addoption("--skein-only", default="", metavar="WORDS", help="Only these checks or flights, by commas.")
    group.addoption("--skein-damaged", type=int, default=2000, metavar="N", help="How many damaged datagrams are sent.")


def pytest_configure(config: pytest.Config) -> None:
    """Collect the kit instead of this project's tests, unless paths are named."""
    if config.getoption("--skein-vehicle") and config.args_source is not pytest.Config.ArgsSource.ARGS:
        config.args = [str(TESTS)]


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Exempt the kit's flights from this project's test time-outs."""
    for item in items:
        if item.path == TESTS and config.pluginmanager.hasplugin("timeout"):
            item.add_marker(pytest.mark.timeout(0))
