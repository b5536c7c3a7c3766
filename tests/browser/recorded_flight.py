"""Records the fake flight while a live page is open: the page's last state, and the recording."""

import subprocess
import sys
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import msgspec
from fake_flight import FakeFlight
from mcap.opcode import Opcode
from serve_fake import field_json

from groundstation.bus import messages as m
from groundstation.process.child import ChildSpec
from groundstation.recording.chunks import frames


@dataclass(frozen=True)
class Recorded:
    """A run folder, and the last state of a live page."""

    folder: Path
    live: dict[str, Any]


def start_recorder(endpoint: str, folder: Path) -> "subprocess.Popen[bytes]":
    section = {"field": field_json(8765), "run_dir": str(folder), "epoch": 1}
    spec = ChildSpec("recorder", "recorder", endpoint, "lab", section=msgspec.json.encode(section).decode())
    process = subprocess.Popen(
        [sys.executable, "-m", "groundstation.process.entry", "recorder", "groundstation.runtime.recorder:run"],
        stdin=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
    )
    assert process.stdin is not None
    process.stdin.write(msgspec.json.encode(spec))
    process.stdin.close()
    return process


def _until_it_records(path: Path) -> None:
    """Wait for a second chunk: a recording that starts with a burst of messages would show the flight from there."""
    deadline = time.monotonic() + 30
    while not (path.exists() and _chunks(path) >= 2):
        assert time.monotonic() < deadline, "the recorder does not start"
        time.sleep(0.1)


def _chunks(path: Path) -> int:
    with path.open("rb") as stream:
        return sum(opcode == Opcode.CHUNK for opcode, _body in frames(stream, []))


def record(flight: FakeFlight, page: Any, folder: Path, seconds: float) -> Recorded:
    """Record a flight to its end while a live page is open."""
    recorder = start_recorder(flight.endpoint, folder)
    try:
        _until_it_records(folder / "state.mcap")
        flight.event(m.Severity.WARNING, "a gust", "drone_1", "wait")
        page.there("hold").click()
        page.wait(lambda s: s["orders"] and s["orders"][0]["state"] == "confirmed")
        page.page.wait_for_timeout(round(1000 * seconds))
        flight.finish()
        page.page.wait_for_timeout(1000)
        return Recorded(folder, page.state())
    finally:
        recorder.terminate()
        recorder.wait(10)
