"""Parameters of tests that run on demand."""

from collections.abc import Iterable
from typing import Any

import pytest


def on_demand(values: Iterable[Any]) -> list[Any]:
    """Return one parameter for each value, which only `make test-exhaustive` runs."""
    return [pytest.param(value, marks=pytest.mark.exhaustive) for value in values]
