"""Recordings to replay, flown once for all tests."""

import sys
from pathlib import Path

import pytest

from groundstation.field.resolved import ResolvedField

sys.path.insert(0, str(Path(__file__).parent))  # for the helper modules of this folder


@pytest.fixture(scope="session")
def flown(tmp_path_factory: pytest.TempPathFactory, lab_field: ResolvedField) -> Path:
    """A run folder: take-off and a second of tracking by two drones."""
    from flown_study import FlownStudy

    from sim_bridge.study.runner import StudyOptions

    folder = tmp_path_factory.mktemp("flown")
    FlownStudy(lab_field, folder, StudyOptions(seed=3, duration_s=1.5)).fly()
    return folder
