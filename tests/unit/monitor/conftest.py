"""Fixtures of the monitor's tests."""

import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))  # for the helper modules of this folder
from monitor_world import World


@pytest.fixture
def world() -> World:
    return World()
