"""Fixtures of the console server's tests."""

import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

sys.path.insert(0, str(Path(__file__).parent))  # for the helper modules of this folder
from page_modules import run_in_node


@pytest.fixture
def said(tmp_path: Path) -> Callable[[str], Any]:
    """Return a function that runs a script with the page's modules, and returns its `result`."""
    return lambda script: run_in_node(tmp_path / "js", script)
