"""A room that differs from its field: no drone takes off unless a person insists."""

import operator
import sys
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import pytest

from groundstation.bus.messages import Event
from groundstation.bus.topics import EVENT
from groundstation.recording.file_topics import STATE
from groundstation.recording.reader import open_parts, parts

pytestmark = [pytest.mark.sitl, pytest.mark.slow, pytest.mark.timeout(240)]
ASIDE = "cameras.ceiling.position_m=[0.2,0.0,4.2]"
CODES = ("drones.drone_1.marker.code=2", "drones.drone_2.marker.code=1")


def room(*changes: str) -> tuple[str, ...]:
    return (sys.executable, str(Path(__file__).with_name("differing_room.py")), *changes, "--")


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ((ASIDE,), "ceiling hangs 0.2"),
        pytest.param(CODES, "drone_1 stands on the pad of drone_2", marks=pytest.mark.exhaustive),
    ],
)
def test_a_wrong_room_is_refused_on_the_floor(sitl: Callable[..., Any], changes: tuple[str, ...], words: str) -> None:
    run = sitl("--duration", "10", program=room(*changes))
    assert run.wait(120) == 4, run.text
    assert words in run.text and "nobody took off" in run.text and "--anyway" in run.text
    assert max(state.position_m[2] for name in ("drone_1", "drone_2") for _, state in run.truth(name)) < 0.1


@pytest.mark.exhaustive
def test_a_take_off_in_a_wrong_room_by_override_is_recorded(sitl: Callable[..., Any]) -> None:
    run = sitl("--duration", "10", "--anyway", program=room(ASIDE))
    run.wait(150)
    assert "operator insists" in run.text, run.text
    recorded, _ = open_parts(parts(run.run_dir, STATE))
    told = [r.message for part in recorded for r in part.records(partial(operator.is_, EVENT))]
    events = [message for message in told if isinstance(message, Event)]
    (override,) = [event for event in events if "although it must not" in event.text]
    assert override.text.startswith("operator takes off") and "ceiling hangs" in override.text
    assert override.severity == "WARNING" and override.header.source == "supervisor"
    assert max(state.position_m[2] for _, state in run.truth("drone_1")) > 0.5
