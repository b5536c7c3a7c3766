"""A target that may be anywhere in the room is shown nowhere."""

import json
from dataclasses import replace

import msgspec
import pytest
from monitor_world import CAST, NOW, World

from groundstation.bus import keys
from groundstation.bus import messages as m
from groundstation.bus import topics as t
from groundstation.bus.api import Received
from groundstation.console.snapshot import Snapshot
from groundstation.console.state import ConsoleState
from groundstation.monitor.whereabouts import is_anywhere

ROOM_M = (7.0, 5.0)
CAST_OF_ROOM = replace(CAST, room_m=ROOM_M)
GONE = (12.79, -11.45), 93.0


def _target(mean: tuple[float, float], std_m: float, *, converged: bool = False) -> m.EntityEstimate:
    variance = std_m**2
    return m.EntityEstimate("turtlebot", "target", mean, (variance, 0.0, 0.0, variance), (0.3, 0.0), converged, 65.0)


def _estimate(target: m.EntityEstimate) -> m.Estimate:
    return m.Estimate(header=m.Header(NOW, "here", "team", "tracker", 1), entities=(target,), epoch=1)


@pytest.mark.parametrize(("mean", "std_m", "converged", "anywhere"), [
    (*GONE, False, True),
    ((1.0, 1.0), 1.7, False, False),   # 4.2 m: half the room's diagonal is 4.3 m
    ((1.0, 1.0), 1.8, False, True),
    ((3.6, 1.0), 0.5, False, True),    # behind the wall
    ((3.6, 1.0), 0.05, True, False),   # seen behind it: the room may be measured wrongly
])  # fmt: skip
def test_an_ellipse_larger_than_the_room_says_nothing(
    mean: tuple[float, float], std_m: float, converged: bool, anywhere: bool
) -> None:
    assert is_anywhere(_target(mean, std_m, converged=converged), ROOM_M) is anywhere


def test_a_drone_beyond_the_walls_is_shown_there() -> None:
    assert not is_anywhere(msgspec.structs.replace(_target((9.0, 0.0), 0.5), kind="robot"), ROOM_M)


def test_the_table_says_unknown_instead_of_a_place_beyond_the_walls(world: World) -> None:
    world.state.cast = CAST_OF_ROOM
    world.say(t.ESTIMATE, _estimate(_target(*GONE)))
    (row,) = (line for line in world.text().splitlines() if line.startswith("turtlebot "))
    assert "unknown" in row and "65.0 s" in row
    assert "12.79" not in row and "227" not in row


def test_the_page_gets_no_trail_and_no_curve_of_it() -> None:
    state, board = ConsoleState(CAST_OF_ROOM, 0), Snapshot()
    for place, std_m in (((0.5, 0.0), 0.1), GONE):
        message = _estimate(_target(place, std_m))
        state.ingest([Received(keys.Key("lab", "team", t.ESTIMATE, "s"), message.header, message, b"")])
        state.history._next_trail_ns = state.history._next_sample_ns = 0
        state.note(NOW)
    board.begin()
    state.put(board, NOW)
    said = json.loads(board.since(0))
    assert said["points"] == [["turtlebot", 0.5, 0.0]]
    assert [sample["axis_m"] is None for sample in said["samples"]] == [False, True]
    (target,) = said["estimate"]["entities"]
    assert target["anywhere"] and target["age_s"] == 65.0
