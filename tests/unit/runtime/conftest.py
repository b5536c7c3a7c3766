"""Fixtures of the operator's tests."""

import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))  # what lies here and is no test belongs to these tests
from operated_team import Scene


@pytest.fixture
def scene() -> Scene:
    return Scene()
