"""Fixtures of the ranging driver's tests."""

import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))  # for the helper modules of this folder
from range_rig import Rig, opened


@pytest.fixture
def rig(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> Iterator[Rig]:
    with opened(getattr(request, "param", ()), monkeypatch) as rig:
        yield rig
