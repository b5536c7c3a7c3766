"""Scenarios with faults, and the time at which the first of them begins in flight."""

from pathlib import Path
from typing import Any

import pytest
from sitl_run import FEW_PICTURES


def faults(folder: Path, *lines: str) -> str:
    """Write a scenario with these faults and as few pictures as few_pictures.yaml has; returns its path."""
    path = folder / "faults.yaml"
    path.write_text(FEW_PICTURES.read_text() + "faults:\n" + "".join(f"  - {{{line}}}\n" for line in lines))
    return str(path)


def until_the_first_fault(run: Any, kind: str) -> tuple[float, float]:
    """Wait for the tracking and for the first fault of a scenario; returns when each began [s]."""

    def begun() -> bool:
        return any(kind in text for text in run.events())

    def tracks() -> bool:
        return all(run.mode(name) == "TRACK" for name in run.record.drones)

    if run.until(lambda: begun() or tracks(), 90, "a beginning") and begun():
        pytest.skip(f"this machine was too busy to fly before the first fault:\n{run.text}")
    tracking = run.until_tracking()
    return tracking, run.until(begun, 60, "the first fault")
