"""A re-run is marked as not flown in the replay page, in Rerun's file and in Foxglove's scene; a flight is not."""

import json
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from mcap.reader import make_reader

from groundstation.engineering_views.foxglove_file import write_with_scene
from groundstation.engineering_views.rerun_file import write_rrd
from groundstation.recording.copies import messages_of, new_copy, preamble_copy
from groundstation.recording.reader import RecordingError, open_recording
from groundstation.recording.rerun import Rerun
from groundstation.recording.run import open_run
from groundstation.recording.synthetic import write_run
from groundstation.recording.viewers import SCENE_CHANNEL
from groundstation.replay.playback import Playback
from groundstation.replay.playback_server import Show
from groundstation.replay.source import open_source
from groundstation.settings.files import find_field
from groundstation.settings.load import load_field

KINDS = {"re-run": Rerun("a flight"), "what-if": Rerun("a flight", "planner.horizon_steps=3"), "flight": None}


@pytest.fixture(scope="module")
def flight(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("marks") / "flight"
    folder.mkdir()
    write_run(folder, load_field(find_field("lab"), ()).model_dump_json().encode(), 0.5)
    return folder


@pytest.fixture(params=KINDS)
def kind(request: pytest.FixtureRequest) -> str:
    return str(request.param)


@pytest.fixture
def folder(kind: str, flight: Path, tmp_path: Path) -> Path:
    """Return the folder of a recording marked with its re-run, as `replay --output` writes it."""
    rerun = KINDS[kind]
    note = rerun.as_metadata() if rerun else {}
    with new_copy(tmp_path / "state.mcap", preamble_copy(open_recording(flight / "state.mcap"), note)) as writer:
        for index in open_run(flight / "state.mcap").indexes:
            for message in messages_of(index):
                writer.write(message)
    return tmp_path


def mark(kind: str) -> bytes:
    return f"{kind.upper()}, not flown".encode()


def test_the_page(kind: str, folder: Path) -> None:
    server = Show(Playback(open_source([folder])), 38910).server
    server._listener.close()
    said: dict[str, Any] = json.loads(server._seed(0))["scene"]["replay"]
    if kind == "flight":
        assert (said["what"], said["note"]) == ("REPLAY", "")
        return
    assert said["what"].encode() == mark(kind)
    assert said["note"].startswith(f"{kind} of a flight with ")
    assert ("horizon_steps" in said["note"]) == (kind == "what-if")


def test_the_file_for_rerun(kind: str, folder: Path, tmp_path: Path) -> None:
    pytest.importorskip("rerun")
    write_rrd(open_run(folder), tmp_path / "flight.rrd")
    # The bytes of the file are compressed, sometimes in the middle of the texts.
    command = [sys.executable, "-m", "rerun", "rrd", "print", "-vvv", str(tmp_path / "flight.rrd")]
    printed = subprocess.run(command, capture_output=True, timeout=100, check=True).stdout
    # The recording's name, and the text above the room.
    assert printed.count(mark(kind)) == (0 if kind == "flight" else 2)


def test_the_scene_for_foxglove(kind: str, folder: Path, tmp_path: Path) -> None:
    pytest.importorskip("foxglove")
    write_with_scene(open_run(folder), tmp_path / "scene.mcap")
    with (tmp_path / "scene.mcap").open("rb") as stream:
        reader = make_reader(stream)
        scenes = [message.data for _, _, message in reader.iter_messages(topics=[SCENE_CHANNEL])]
        records = {record.name: record.metadata for record in reader.iter_metadata()}
    assert scenes and all((mark(kind) in scene) == (kind != "flight") for scene in scenes)
    assert ("replay" in records) == (kind != "flight"), "the copy keeps what it repeats"


def test_two_runs_of_one_boot_are_not_one_recording(flight: Path, tmp_path: Path) -> None:
    """A replay of both would be a flight that never took place; parts of one run belong together, a damaged one too."""
    opened = open_recording(flight / "state.mcap")
    for name, command in (("a", b'{"seed":1}'), ("b", b'{"seed":2}'), ("c", b'{"seed":1}'), ("damaged", b"")):
        told = preamble_copy(opened, {})
        attached = {**told.attachments, "run.json": ("application/json", command)} if command else told.attachments
        with new_copy(tmp_path / f"state-{name}.mcap", replace(told, attachments=attached)) as writer:
            for index in open_run(flight / "state.mcap").indexes:
                for message in messages_of(index):
                    writer.write(message)
    a, b, c, damaged = (tmp_path / f"state-{name}.mcap" for name in ("a", "b", "c", "damaged"))
    assert open_source([a, c, damaged]).state
    with pytest.raises(RecordingError, match="not parts of one recording"):
        open_source([a, b])
