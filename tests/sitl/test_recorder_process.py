"""The recorder as a real process: the readable part after kill -9 and after an orderly stop."""

import json
import operator
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import closing
from functools import partial
from pathlib import Path

import msgspec
import pytest

from groundstation.bus import zenoh_bus
from groundstation.bus.messages import TruthState
from groundstation.bus.topics import PROCESS_STATUS, RAW_RX, TRUTH
from groundstation.process.child import ChildSpec
from groundstation.recording.reader import open_recording
from groundstation.settings.files import find_field
from groundstation.settings.load import load_field

pytestmark = pytest.mark.sitl
REPOSITORY = Path(__file__).parents[2]
SENT_S = 6.0
FIELD = load_field(find_field("lab")).model_dump(mode="json")


@pytest.fixture
def endpoint() -> Iterator[str]:
    with closing(socket.socket()) as probe:
        probe.bind(("127.0.0.1", 0))
        address = f"tcp/127.0.0.1:{probe.getsockname()[1]}"
    router = zenoh_bus.open_router(address)
    yield address
    router.close()


def _start(endpoint: str, run_dir: Path) -> subprocess.Popen[bytes]:
    section = {"field": FIELD, "run_dir": str(run_dir), "epoch": 3}
    spec = ChildSpec(name="recorder", role="recorder", endpoint=endpoint, site="lab", section=json.dumps(section))
    command = [sys.executable, "-m", "groundstation.process.entry", "recorder", "groundstation.runtime.recorder:run"]
    process = subprocess.Popen(command, cwd=REPOSITORY, stdin=subprocess.PIPE, stderr=subprocess.DEVNULL)
    assert process.stdin is not None
    process.stdin.write(msgspec.json.encode(spec))
    process.stdin.close()
    return process


def _publish_until(bus: zenoh_bus.ZenohBus, until: float, sent: list[int]) -> None:
    while time.monotonic() < until:
        sent.append(len(sent))
        header = bus.header("drone_1")
        zeros = (0.0, 0.0, 0.0)
        truth = TruthState(header=header, position_m=zeros, velocity_m_s=zeros, attitude_rad=zeros, on_ground=False)
        bus.publish(TRUTH, truth)
        bus.publish_bytes(RAW_RX, header, bytes(300))
        time.sleep(0.004)


@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGTERM])
def test_recording_is_readable_after(number: signal.Signals, endpoint: str, tmp_path: Path) -> None:
    process = _start(endpoint, tmp_path)
    try:
        with closing(zenoh_bus.open_bus(endpoint, "lab", "tester")) as bus:
            statuses = bus.subscribe([PROCESS_STATUS], entity="recorder")
            assert statuses.wait(20.0)
            deadline = time.monotonic() + 20.0
            while not any(received.message.state == "READY" for received in statuses.drain()):  # type: ignore[union-attr]
                assert time.monotonic() < deadline
                statuses.wait(0.2)
            sent: list[int] = []
            _publish_until(bus, time.monotonic() + SENT_S, sent)
            process.send_signal(number)
            process.wait(timeout=10.0)
    finally:
        process.kill()
        process.wait()
    for stem, topic in (("state", TRUTH), ("raw", RAW_RX)):
        recording = open_recording(tmp_path / f"{stem}.mcap")
        numbers = [raw.sequence for raw in recording.raw_records(partial(operator.is_, topic))]
        assert numbers == sorted(numbers)
        assert len(numbers) >= 0.95 * len(sent)
        assert bool(recording.damage) == (number is signal.SIGKILL)
    assert recording.metadata["run"]["epoch"] == "3"
    assert json.loads(recording.attachments["field.json"]) == FIELD
