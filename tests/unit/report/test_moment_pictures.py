"""Camera pictures of a run's most serious moments; none for a run without pictures."""

import base64
from pathlib import Path

import cv2
import numpy as np
import pytest

from groundstation.bus.memory_bus import MemoryBus, MemoryExchange
from groundstation.bus.messages import Header
from groundstation.bus.topics import IMAGE
from groundstation.recording.capture import Capture
from groundstation.recording.mcap_file import McapFile
from groundstation.recording.preamble import Preamble
from groundstation.recording.timeline import Timeline
from groundstation.report.moment_pictures import moment_pictures
from groundstation.report.run_facts import RunFacts
from groundstation.report.story import Moment
from groundstation.report.tracks import UNKNOWN_FIELD, RunData

S = 1_000_000_000
UNIX = 1_700_000_000 * S
DATA = RunData(UNKNOWN_FIELD, RunFacts(), start_unix_ns=UNIX, end_s=20.0)


def jpeg(grey: int) -> bytes:
    return bytes(cv2.imencode(".jpg", np.full((72, 128), grey, np.uint8))[1])


@pytest.fixture
def run_dir(tmp_path: Path) -> Path:
    """Two cameras with a picture each second from 10 s on, of rising brightness; one of the pictures is damaged."""
    bus = MemoryBus(MemoryExchange(), "lab", "tester")
    queue = bus.subscribe([IMAGE], capacity=64)
    for second in range(10, 16):
        for camera, offset in (("ceiling", 0), ("drone_1_camera", 100)):
            picture = b"no jpeg" if (second, camera) == (15, "ceiling") else jpeg(10 * second - 90 + offset)
            bus.publish_bytes(IMAGE, Header(second * S, "here", camera, "tester", second), picture)
    capture, file = Capture(Timeline("here", UNIX)), McapFile(tmp_path / "raw.mcap", Preamble({}, {}, UNIX))
    for sample in queue.drain_samples():
        entry = capture.entry(sample, 20 * S)
        assert entry is not None
        file.write(entry)
    file.close()
    return tmp_path


def grey_of(uri: str) -> float:
    picture = cv2.imdecode(np.frombuffer(base64.b64decode(uri.split(",")[1]), np.uint8), cv2.IMREAD_GRAYSCALE)
    assert picture is not None
    return float(picture.mean())


def test_a_moment_shows_the_last_picture_before_it_of_the_camera_that_it_names(run_dir: Path) -> None:
    moments = [
        Moment(12.4, "failsafe", "drone_1 LANDING"),
        Moment(13.4, "error", "drone_1_camera: it sees nothing"),
        Moment(13.4, "order", "operator orders LAND"),
        Moment(5.0, "fault", "before the first picture"),
        Moment(15.4, "warning", "the ceiling camera's picture is damaged"),
    ]
    found = moment_pictures(run_dir, DATA, moments)
    assert [(one.moment.time_s, one.camera) for one in found] == [
        (12.4, "ceiling"), (13.4, "drone_1_camera"), (15.4, "drone_1_camera"),
    ]  # fmt: skip
    assert [grey_of(one.uri) for one in found] == pytest.approx([30, 140, 160], abs=2.0)


def test_many_moments_give_eight_pictures_and_none_twice(run_dir: Path) -> None:
    moments = [Moment(10.0 + 0.1 * step, "warning", f"warning {step}") for step in range(50)]
    found = moment_pictures(run_dir, DATA, moments)
    assert 4 <= len(found) <= 8 and len({one.uri for one in found}) == len(found)


def test_a_run_without_pictures_has_none(tmp_path: Path) -> None:
    assert moment_pictures(tmp_path, DATA, [Moment(1.0, "fault", "x")]) == []
