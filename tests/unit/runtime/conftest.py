"""Fixtures of the operator's tests."""

import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))  # for the helper modules of this folder
from operated_team import Scene


@pytest.fixture
def scene() -> Scene:
    return Scene()
