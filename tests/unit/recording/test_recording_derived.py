"""Data for viewers in recordings beside our own messages: all coordinate frames, and events as log lines."""

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
from groundstation.bus.topics import CAMERA_STATUS, OBSERVATION, Topic
from groundstation.cli.bench import bench
from groundstation.field.resolved import ResolvedField
from groundstation.geometry.rotations import base_from_tilted_optical
from groundstation.recording.capture import Entry
from groundstation.recording.derived import ViewerChannels, camera_frames
from groundstation.recording.protobuf import fields
from groundstation.recording.schemas import description_of
from groundstation.recording.synthetic import write_run
from groundstation.recording.viewers import is_for_viewers
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


def test_pictures_have_their_lens_and_a_mark_for_each_body(lab_field: ResolvedField) -> None:
    channels = ViewerChannels(lab_field)
    lens = lab_field.cameras["ceiling"].calibration
    header = m.Header(5_000, "here", "ceiling", "ceiling", 0)

    def sighting(subject: str, place: tuple[float, float, float], stamp_ns: int) -> list[float]:
        message = m.RelativeObservation(
            header=msgspec.structs.replace(header, stamp_ns=stamp_ns), observer="ceiling", subject=subject,
            camera="ceiling", position_m=place, yaw_rad=None, covariance=(0.0,) * 9,
        )  # fmt: skip
        entry = entry_of(OBSERVATION, msgspec.json.encode(message))
        (found,) = channels.derived(entry)
        assert (found.channel, found.derived) == ("/annotations/ceiling", True)
        circles = [dict(fields(body)) for number, body in fields(found.data) if number == 1 and isinstance(body, bytes)]
        return [value for circle in circles for value in _numbers(circle, 2)]

    def entry_of(topic: Topic, data: bytes) -> Entry:
        return Entry("gs/x", 7, 7, 0, data, description_of(topic), {"topic": topic.name, "entity": "ceiling"})

    assert sighting("drone_1", (0.0, 0.0, 3.0), 1) == pytest.approx([lens.cx_px, lens.cy_px])
    assert len(sighting("drone_2", (0.5, 0.0, 3.0), 1)) == 4, "two bodies of one picture"
    assert len(sighting("drone_2", (0.5, 0.0, 3.0), 2)) == 2, "another picture"
    assert sighting("drone_2", (0.5, 0.0, -3.0), 3) == [], "behind the camera"
    (found,) = channels.derived(entry_of(CAMERA_STATUS, b"{}"))
    assert found.channel == "/calibration/ceiling"
    by_number: dict[int, list[float]] = {}
    for number, value in fields(found.data):
        if number in (5, 6, 8) and isinstance(value, bytes):
            by_number.setdefault(number, []).append(struct.unpack("<d", value)[0])
    assert by_number[6] == [lens.fx_px, 0, lens.cx_px, 0, lens.fy_px, lens.cy_px, 0, 0, 1]
    assert (len(by_number[5]), len(by_number[8])) == (5, 12)
    assert not any(is_for_viewers(name) for name in ("gs/lab/state/ceiling/observation/ceiling", "/other"))


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
    assert ViewerChannels().derived(entry) == ()


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
