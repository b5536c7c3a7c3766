"""What all tests share: compiled kernels come from a cache that knows the state of their sources."""

from pathlib import Path
from typing import Any

import pytest

from groundstation.process import numba_cache

numba_cache.activate(numba_cache.EVERYTHING)

CONFIG = Path(__file__).parents[1] / "config"


@pytest.fixture(scope="session")
def lab_field() -> dict[str, Any]:
    """The shipped field, resolved, as the tracker's section holds it."""
    from groundstation.settings.load import load_field

    return load_field(CONFIG / "lab.yaml").model_dump(mode="json")
