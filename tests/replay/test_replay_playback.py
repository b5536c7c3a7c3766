"""Playback of a recording in the console's server: play, pause, seek, and no commands."""

import json
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from rewritten import rewritten

from groundstation.console.protocol import decode
from groundstation.console.snapshot import Snapshot
from groundstation.console.viewer import PageConnection
from groundstation.recording.reader import RecordingError
from groundstation.replay import playback_server
from groundstation.replay.playback import Playback
from groundstation.replay.playback_server import Show
from groundstation.replay.source import open_source

MS = 1_000_000


class Watched:
    """A replay without a web server: the console's turns by hand, and a page's state after each."""

    def __init__(self, folder: Path) -> None:
        self.playback = Playback(open_source([folder]))
        self.show = Show(self.playback, 38900)
        self.said: list[dict[str, Any]] = []
        self.page = PageConnection(1, Snapshot(), _nothing, _nothing)
        self.page.say = lambda text: self.said.append(json.loads(text))  # type: ignore[method-assign]
        self.page.trusted = True
        self.turn()

    def turn(self, elapsed_s: float = 0.05) -> None:
        self.show._at_s -= elapsed_s
        self.show.turn()
        self.show.server.turn(self.playback.now_ns())

    def go(self, seconds: float) -> None:
        for _ in range(round(seconds / 0.05)):
            self.turn()

    def ask(self, kind: str, **content: Any) -> None:
        self.show.server.sessions.handle(self.page, decode(json.dumps({"type": kind, **content})))
        self.turn(0.0)

    @property
    def sections(self) -> dict[str, Any]:
        return dict(json.loads(self.show.server.board.since(-1)))

    @property
    def seed(self) -> dict[str, Any]:
        return dict(json.loads(self.show.server._seed(1)))

    @property
    def at_s(self) -> float:
        return (self.playback.at_ns - self.playback.reel.start_ns) / 1e9


async def _nothing(_frame: Any) -> None:
    pass


@pytest.fixture
def watched(flown: Path) -> Iterator[Watched]:
    made = Watched(flown)
    yield made
    made.show.server._listener.close()


def test_time_goes_on_as_fast_as_it_is_asked_to(flown: Path) -> None:
    playback = Playback(open_source([flown]))

    def gone_s(seconds: float) -> float:
        before_ns = playback.at_ns
        for _ in range(round(seconds / 0.05)):
            stretches = list(playback.advance(0.05))
            assert all(0 < until - after <= 200 * MS for after, until in stretches)
        return (playback.at_ns - before_ns) / 1e9

    for speed, expected_s in ((1.0, 1.0), (0.1, 0.1), (4.0, 4.0)):
        playback.set_speed(speed)
        assert gone_s(1.0) == pytest.approx(expected_s, abs=1e-6)
    playback.play(False)
    assert gone_s(1.0) == 0.0
    playback.play(True)
    list(playback.advance(60.0))  # the pause is not made up for
    assert (playback.at_ns - playback.reel.start_ns) / 1e9 < 6.2


def test_a_seek_shows_what_was_seen_then(watched: Watched) -> None:
    """A viewer who has watched until a time and one who jumps to it see the same."""
    watched.ask("speed", factor=1.0)
    while watched.at_s < 7.5:
        watched.go(0.5)
    watched.ask("play", playing=False)
    watched.go(0.5)
    played, history = watched.sections, watched.seed["history"]
    at_ms = played["playback"]["at_ms"]
    watched.ask("seek", at_ms=at_ms - 3000)
    earlier = watched.sections
    assert earlier["estimate"]["at"] < played["estimate"]["at"] - 2900
    watched.ask("seek", at_ms=at_ms)
    watched.go(0.5)
    jumped = watched.sections
    for name in ("estimate", "setpoints", "truth", "vehicles", "plan", "health", "events", "orders", "alarms"):
        assert jumped[name] == played[name], name
    assert sorted(jumped["sightings"]) == sorted(played["sightings"])
    again = watched.seed["history"]
    assert set(again["trails"]) == set(history["trails"]) == {"drone_1", "drone_2", "turtlebot"}
    for name, trail in history["trails"].items():
        assert len(again["trails"][name]) == pytest.approx(len(trail), abs=3)
    assert len(again["samples"]) == pytest.approx(len(history["samples"]), abs=2)


def test_a_jump_is_shown_before_all_that_led_to_it_is_read(watched: Watched, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(playback_server, "_GLANCE_NS", 1_000 * MS)
    watched.ask("seek", at_ms=watched.seed["scene"]["replay"]["end_ms"])
    estimate, first = watched.sections["estimate"], watched.seed["history"]
    assert len(first["trails"]["drone_1"]) <= 6, "one second of five points"
    watched.turn(0.0)
    assert watched.sections["estimate"] == estimate
    assert len(watched.seed["history"]["trails"]["drone_1"]) > 6


def test_steps_are_ticks_of_the_tracker(watched: Watched) -> None:
    watched.ask("seek", at_ms=watched.seed["scene"]["replay"]["start_ms"] + 6000)
    watched.ask("step", ticks=1)
    first = watched.sections["estimate"]["at"]
    watched.ask("step", ticks=1)
    assert watched.sections["estimate"]["at"] == pytest.approx(first + 20.0)
    watched.ask("step", ticks=-3)
    assert watched.sections["estimate"]["at"] == pytest.approx(first - 40.0)
    assert watched.sections["playback"]["playing"] is False


def test_ends_are_ends(watched: Watched) -> None:
    about = watched.seed["scene"]["replay"]
    watched.ask("seek", at_ms=about["end_ms"] + 99_000)
    assert watched.sections["playback"] == {
        "at_ms": pytest.approx(about["end_ms"], abs=0.01), "playing": False, "speed": 1.0, "ended": True,
    }  # fmt: skip
    watched.ask("step", ticks=5)
    assert watched.sections["playback"]["ended"]
    watched.ask("play", playing=True)  # from the start again
    assert watched.at_s < 1.0
    watched.ask("seek", at_ms=0.0)
    watched.ask("step", ticks=-5)
    assert watched.at_s == 0.0


@pytest.mark.parametrize(
    "order",
    [
        {"type": "order", "verb": "LAND", "drones": [], "run": "", "at_ms": 0, "age_ms": 0, "ref": "a"},
        {"type": "order", "verb": "TAKEOFF", "drones": [], "run": "", "at_ms": 0, "age_ms": 0, "ref": "a"},
        {"type": "takeover"},
        {"type": "drive", "speed_m_s": 1, "turn_rad_s": 0},
        {"type": "place", "x_m": 0, "y_m": 0},
    ],
)
def test_nothing_can_be_commanded(watched: Watched, order: dict[str, Any]) -> None:
    watched.ask(order.pop("type"), **order)
    (answer,) = watched.said
    assert "replay" in answer["text"] and answer["ref"] == order.get("ref", "")
    assert watched.show.server.sessions.refused["replay"] == 1
    assert watched.sections["session"]["operator"] == ""


@pytest.mark.parametrize(
    "message", ['{"type":"speed","factor":50}', '{"type":"seek","at_ms":-1}', '{"type":"step","ticks":1000000}']
)
def test_knobs_have_their_limits(message: str) -> None:
    from groundstation.errors import MessageError

    with pytest.raises(MessageError):
        decode(message)


def test_events_and_orders_are_marked_on_the_time_line(watched: Watched) -> None:
    marks = watched.seed["scene"]["replay"]["marks"]
    assert [mark["text"] for mark in marks if mark["kind"] == "COMMAND"] == ["LAND all"]


def test_a_replay_with_a_field_of_another_kind_says_so(flown: Path, tmp_path: Path) -> None:
    keep: Callable[..., bytes] = lambda record: record.data  # noqa: E731
    folder = rewritten(flown, tmp_path / "odd", keep, field=b'{"site": "lab"}')
    with pytest.raises(RecordingError, match="this version cannot read its field"):
        Show(Playback(open_source([folder])), 38901)
