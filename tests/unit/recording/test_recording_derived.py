"""What recordings say for viewers beside our own messages: where every frame is, and events as log lines."""

import json
import math
import struct
from pathlib import Path

import msgspec
import numpy as np
import pytest
from click.testing import CliRunner
from mcap.reader import make_reader

from groundstation.bus import messages as m
from groundstation.cli.bench import bench
from groundstation.field.resolved import ResolvedField
from groundstation.geometry.rotations import base_from_tilted_optical
from groundstation.recording.capture import Entry
from groundstation.recording.derived import ViewerChannels, camera_frames
from groundstation.recording.protobuf import fields
from groundstation.recording.schemas import description_of
from groundstation.recording.synthetic import write_run
from groundstation.settings.files import find_field
from groundstation.settings.load import load_field


@pytest.fixture(scope="module")
def field() -> bytes:
    return load_field(find_field("lab"), ()).model_dump_json().encode()


def _messages(path: Path, topic: str) -> list[bytes]:
    with path.open("rb") as stream:
        return [message.data for _, _, message in make_reader(stream).iter_messages(topics=[topic])]


def _text(part: dict[int, int | bytes], number: int) -> str:
    value = part[number]
    assert isinstance(value, bytes)
    return value.decode()


def _numbers(part: dict[int, int | bytes], number: int) -> list[float]:
    value = part[number]
    assert isinstance(value, bytes)
    return [struct.unpack("<d", one)[0] for _, one in fields(value) if isinstance(one, bytes)]


def _rotation(x: float, y: float, z: float, w: float) -> np.ndarray:
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def test_every_frame_has_its_place_ten_times_a_second(field: bytes, tmp_path: Path) -> None:
    write_run(tmp_path, field, 2.0)
    said = _messages(tmp_path / "state.mcap", "/tf")
    assert len(said) == pytest.approx(20, abs=1)
    frames = {}
    for _, body in fields(said[0]):
        assert isinstance(body, bytes)
        part = dict(fields(body))
        frames[_text(part, 3)] = (_text(part, 2), _numbers(part, 4), _numbers(part, 5))
    assert {name: parent for name, (parent, _, _) in frames.items()} == {
        "drone_1": "world",
        "drone_2": "world",
        "turtlebot": "world",
        "ceiling": "world",
        "drone_1_camera": "drone_1",
        "drone_2_camera": "drone_2",
    }
    assert frames["ceiling"][1] == [0.0, 0.0, 4.2]
    # A camera that looks down: its picture's x axis is the world's, its optical axis points to the floor.
    assert _rotation(*frames["ceiling"][2]) == pytest.approx(np.diag([1.0, -1.0, -1.0]), abs=1e-12)
    tilted = base_from_tilted_optical(math.radians(45.0))
    assert _rotation(*frames["drone_1_camera"][2]) == pytest.approx(tilted, abs=1e-12)
    assert _rotation(*frames["drone_2"][2]) @ [1.0, 0.0, 0.0] == pytest.approx([math.cos(0.3), math.sin(0.3), 0.0])


def test_events_are_log_lines_with_their_remedy(field: bytes, tmp_path: Path) -> None:
    write_run(tmp_path, field, 0.5)
    (line,) = _messages(tmp_path / "state.mcap", "/log")
    part = dict(fields(line))
    assert (part[2], _text(part, 3), _text(part, 4)) == (2, "at 0 s (nothing is wrong)", "drone_1")


@pytest.mark.parametrize("topic", ["estimate", "event"])
@pytest.mark.parametrize("data", [b"{}", b'{"entities":[{"name":"x","mean":[1]}]}', b'{"severity":"LOUD","text":""}'])
def test_a_message_that_is_malformed_inside_costs_the_viewers_line_only(topic: str, data: bytes) -> None:
    from groundstation.bus.topics import ESTIMATE, EVENT

    described = description_of(ESTIMATE if topic == "estimate" else EVENT)
    entry = Entry("gs/x", 1, 1, 0, data, described, {"topic": topic, "entity": "team"})
    assert ViewerChannels().derived(entry) is None


def test_a_field_without_cameras_has_no_camera_frames(lab_field: ResolvedField) -> None:
    assert camera_frames(msgspec.structs.replace(lab_field, cameras={}, drones={})) == ()


def test_severities_have_levels() -> None:
    from groundstation.recording.viewers import log_line

    assert [dict(fields(log_line(0, level, "a", "b")))[2] for level in m.Severity] == [2, 3, 4]


def test_bench_measures_writing_opening_and_seeking_beside_a_peer() -> None:
    result = CliRunner().invoke(bench, ["recording", "--minutes", "0.1", "--json"], standalone_mode=False)
    assert result.exception is None
    found = json.loads(result.output)
    assert found["messages"] > 5000 and found["duration_s"] == pytest.approx(6.0)
    for name in ("write_us_per_message", "open_s", "seek_s", "peer_write_us_per_message", "peer_open_s", "peer_seek_s"):
        assert found[name] > 0.0
    assert set(found["limits"]) <= set(found) and isinstance(found["passed"], bool)
