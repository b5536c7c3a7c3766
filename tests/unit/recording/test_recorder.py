"""The recorder's loop with a memory bus: a full disk is reported once and costs only the recording."""

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import cv2
import msgspec
import numpy as np
import pytest

from groundstation.bus import clock
from groundstation.bus.jpeg import stated_size
from groundstation.bus.memory_bus import MemoryBus, MemoryExchange
from groundstation.bus.messages import Event, Severity
from groundstation.bus.topics import EVENT, IMAGE, VIDEO
from groundstation.recording import disk_space
from groundstation.recording import rotating_file as series_module
from groundstation.recording.blurring import blurred
from groundstation.recording.mcap_file import McapFile
from groundstation.recording.reader import open_recording, parts
from groundstation.recording.writing import RunWriter
from groundstation.runtime import recorder as recorder_module
from groundstation.runtime.recorder import Recorder, RecorderSection
from groundstation.settings.files import find_field
from groundstation.settings.load import load_field


class FakeChild:
    """Records the recorder's reports about itself."""

    def __init__(self, bus: MemoryBus) -> None:
        self.bus = bus
        self.name = "recorder"
        self.states: list[tuple[str, str]] = []
        self.events: list[tuple[str, str]] = []

    def ready(self, detail: str = "") -> None:
        self.states.append(("READY", detail))

    def degrade(self, detail: str, works: bool = True) -> None:
        self.states.append(("DEGRADED", detail))

    def event(self, severity: str, text: str, remedy: str = "", entity: str | None = None) -> None:
        self.events.append((str(severity), text))


@pytest.fixture
def sender() -> tuple[MemoryBus, FakeChild]:
    exchange = MemoryExchange()
    return MemoryBus(exchange, "lab", "tester"), FakeChild(MemoryBus(exchange, "lab", "recorder"))


@pytest.fixture
def now(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    now_ns = [1_000_000_000]
    monkeypatch.setattr(clock, "now_ns", lambda: now_ns[0])
    monkeypatch.setattr(recorder_module, "free_bytes", lambda _folder: 10**12)
    return now_ns


def _recorder(child: Any, folder: Path, **recording: bool | str) -> Recorder:
    options = [f"recording.{key}={json.dumps(value)}" for key, value in recording.items()]
    field = load_field(find_field("lab"), options).model_dump_json().encode()
    return Recorder(child, RecorderSection(msgspec.Raw(field), str(folder), 1))


def _say(bus: MemoryBus, text: str) -> None:
    bus.publish(EVENT, Event(header=bus.header("drone_1"), severity=Severity.INFO, text=text))


def test_a_recorder_that_is_started_again_goes_on_with_the_first_ones_time(
    sender: tuple[MemoryBus, FakeChild], now: list[int], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    bus, child = sender
    offset_ns = 1_700_000_000 * 10**9
    for set_by_s in (0, 3600):
        monkeypatch.setattr(clock, "unix_offset_ns", lambda: offset_ns + set_by_s * 10**9)  # noqa: B023
        recorder = _recorder(child, tmp_path)
        _say(bus, "here")
        recorder.turn()
        recorder.close()
    opened = [open_recording(path) for path in parts(tmp_path, "state")]
    assert [part.metadata["run"]["unix_offset_ns"] for part in opened] == [str(offset_ns)] * 2
    told = [record.log_time_ns for part in opened for record in part.records()]
    assert told == [offset_ns + now[0]] * 2


def test_write_error_degrades_once_and_recovers(
    sender: tuple[MemoryBus, FakeChild], now: list[int], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    bus, child = sender
    recorder = _recorder(child, tmp_path)
    recorder.turn()
    _say(bus, "before")
    recorder.turn()
    now[0] += 600_000_000
    recorder.turn()

    def fail(_file: McapFile, *_arguments: object) -> None:
        raise OSError(28, os.strerror(28))

    with monkeypatch.context() as broken:
        broken.setattr(McapFile, "write", fail)
        broken.setattr(McapFile, "_begin", fail)
        for _ in range(6):
            _say(bus, "lost")
            now[0] += 1_000_000_000
            recorder.turn()
    assert [severity for severity, _ in child.events] == ["ERROR"]
    assert child.states[-1][0] == "DEGRADED"
    assert recorder.dropped == 6
    now[0] += series_module.RETRY_PERIOD_NS
    recorder.turn()
    _say(bus, "after")
    recorder.close()
    assert child.states[-1][0] == "READY"
    assert [severity for severity, _ in child.events] == ["ERROR", "WARNING"]
    read = [[raw.data for raw in open_recording(path).raw_records()] for path in parts(tmp_path, "state")]
    assert [len(part) for part in read] == [1, 1]
    assert b"before" in read[0][0] and b"after" in read[1][0]


def test_a_disk_that_is_full_at_the_end_is_told_of(
    sender: tuple[MemoryBus, FakeChild], now: list[int], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    bus, child = sender
    recorder = _recorder(child, tmp_path)
    _say(bus, "landed")
    recorder.turn()

    def fail(_file: McapFile) -> None:
        raise OSError(28, os.strerror(28))

    monkeypatch.setattr(McapFile, "close", fail)
    recorder.close()
    assert ("ERROR", "cannot write the state recording: No space left on device") in child.events
    assert recorder.dropped == 1


def test_low_disk_warns_then_drops_pictures_only(
    sender: tuple[MemoryBus, FakeChild], now: list[int], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    bus, child = sender
    recorder = _recorder(child, tmp_path)
    for free in (10**10, 8 * 10**8, 10**8):
        monkeypatch.setattr(recorder_module, "free_bytes", lambda _folder, free=free: free)
        now[0] += 3_000_000_000
        bus.publish_bytes(IMAGE, bus.header("drone_1"), b"jpeg")
        _say(bus, "state goes on")
        recorder.turn()
    recorder.close()
    assert [severity for severity, _ in child.events] == ["WARNING", "WARNING"]
    assert recorder._space is disk_space.Space.NO_IMAGES
    assert len(list(open_recording(tmp_path / "raw.mcap").raw_records())) == 2
    assert len(list(open_recording(tmp_path / "state.mcap").raw_records())) == 3


def test_messages_sent_while_the_writer_loads_are_recorded(
    sender: tuple[MemoryBus, FakeChild], now: list[int], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    bus, child = sender

    def load_slowly(*arguments: Any) -> RunWriter:
        _say(bus, "meanwhile")
        return RunWriter(*arguments)

    monkeypatch.setattr("groundstation.recording.writing.RunWriter", load_slowly)
    _recorder(child, tmp_path).close()
    (raw,) = open_recording(tmp_path / "state.mcap").raw_records()
    assert b"meanwhile" in raw.data


def test_a_recorder_that_starts_again_loads_formats_only_after_it_listens() -> None:
    script = "import groundstation.runtime.recorder, sys; print(*sys.modules)"
    loaded = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True).stdout.split()
    assert not {"numpy", "mcap", "zstandard", "google.protobuf"} & set(loaded)


def test_datagrams_are_left_out_on_request(sender: tuple[MemoryBus, FakeChild], now: list[int], tmp_path: Path) -> None:
    from groundstation.bus.topics import RAW_RX

    bus, child = sender
    recorder = _recorder(child, tmp_path, raw_datagrams=False)
    bus.publish_bytes(RAW_RX, bus.header("drone_1"), b"navdata")
    bus.publish_bytes(IMAGE, bus.header("drone_1"), b"jpeg")
    recorder.close()
    assert [raw.key.topic for raw in open_recording(tmp_path / "raw.mcap").raw_records()] == [IMAGE]


def test_garbage_on_the_bus_is_counted_and_not_recorded(
    sender: tuple[MemoryBus, FakeChild], now: list[int], tmp_path: Path
) -> None:
    bus, child = sender
    recorder = _recorder(child, tmp_path)
    bus.put(EVENT, "drone_1", b"{garbage", b"")
    _say(bus, "fine")
    recorder.close()
    assert recorder.dropped == 1
    assert recorder.written == 1


@pytest.mark.parametrize(("pictures", "count"), [("none", 0), ("blurred", 1), ("full", 2)])
def test_pictures_are_recorded_as_far_as_the_field_allows(
    pictures: str, count: int, sender: tuple[MemoryBus, FakeChild], now: list[int], tmp_path: Path
) -> None:
    fine = np.random.default_rng(1).integers(0, 255, (240, 320, 3), dtype=np.uint8)
    sharp = cv2.imencode(".jpg", fine)[1].tobytes()
    bus, child = sender
    recorder = _recorder(child, tmp_path, pictures=pictures)
    bus.publish_bytes(IMAGE, bus.header("ceiling"), sharp)
    bus.publish_bytes(VIDEO, bus.header("ceiling"), b"access unit")
    recorder.turn()
    recorder.close()
    path = tmp_path / "raw.mcap"
    kept = [record.data for record in open_recording(path).raw_records()] if path.exists() else []
    assert len(kept) == count
    if pictures == "blurred":
        jpeg = kept[0][kept[0].index(b"\xff\xd8") :]
        seen = cv2.imdecode(np.frombuffer(jpeg, np.uint8), cv2.IMREAD_COLOR)
        assert seen is not None and seen.shape == fine.shape
        assert _detail(seen) < 0.2 * _detail(fine)


@pytest.mark.parametrize(("height", "width"), [(972, 1296), (243, 325)])
def test_a_blurred_picture_keeps_its_size(height: int, width: int) -> None:
    sharp = cv2.imencode(".jpg", np.zeros((height, width, 3), np.uint8))[1].tobytes()
    turned = bytes.fromhex("ffe10022457869660000 49492a0008000000 0100 1201 0300 01000000 06000000 00000000")
    for jpeg in (sharp, sharp[:2] + turned + sharp[2:]):  # EXIF: a phone held upright
        soft = blurred(jpeg)
        assert soft is not None and stated_size(soft) == (width, height)


def test_a_huge_picture_is_left_out_and_recording_goes_on(
    sender: tuple[MemoryBus, FakeChild], now: list[int], tmp_path: Path
) -> None:
    huge, usual = (cv2.imencode(".jpg", np.zeros((side, side), np.uint8))[1].tobytes() for side in (9000, 240))
    bus, child = sender
    recorder = _recorder(child, tmp_path, pictures="blurred")
    for picture in (huge, usual):
        bus.publish_bytes(IMAGE, bus.header("ceiling"), picture)
    recorder.turn()
    recorder.close()
    assert len(list(open_recording(tmp_path / "raw.mcap").raw_records())) == 1


def _detail(picture: Any) -> float:
    return float(np.abs(np.diff(picture.astype(float), axis=1)).mean())
