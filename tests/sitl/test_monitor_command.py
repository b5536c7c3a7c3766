"""`groundstation monitor` against a test bus and its runtime file."""

import json
import os
import threading
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path

import pytest
from free_port import free_port

from groundstation.bus import zenoh_bus
from groundstation.bus.messages import FlightState, VehicleStatus
from groundstation.bus.topics import VEHICLE_STATUS
from groundstation.cli.main import run
from groundstation.supervisor import runtime_file

pytestmark = pytest.mark.sitl


@pytest.fixture
def record(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Iterator[runtime_file.RuntimeRecord]:
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    endpoint = f"tcp/127.0.0.1:{free_port()}"
    router = zenoh_bus.open_router(endpoint)
    ourselves = runtime_file.ProcessRecord(
        "supervisor", "supervisor", os.getpid(), runtime_file.start_time(os.getpid()) or 0
    )
    record = runtime_file.RuntimeRecord(
        site="lab", field="lab", endpoint=endpoint, run_dir=str(tmp_path), heartbeat="", drones=("drone_1",),
        supervisor=ourselves, processes=(),
    )  # fmt: skip
    runtime_file.write(record)
    yield record
    router.close()


def test_monitor_prints_the_state_of_the_only_run(
    record: runtime_file.RuntimeRecord, capsys: pytest.CaptureFixture[str]
) -> None:
    done = threading.Event()

    def speak() -> None:
        with closing(zenoh_bus.open_bus(record.endpoint, "lab", "drone_1")) as bus:
            while not done.wait(0.1):
                status = VehicleStatus(header=bus.header("drone_1"), flight_state=FlightState.FLYING, mode="TRACK")
                bus.publish(VEHICLE_STATUS, status)

    speaker = threading.Thread(target=speak)
    speaker.start()
    try:
        assert run(["monitor", "--json"]) == 0
    finally:
        done.set()
        speaker.join()
    content = json.loads(capsys.readouterr().out)
    assert content["vehicles"]["drone_1"]["message"]["mode"] == "TRACK"
    assert content["vehicles"]["drone_1"]["age_s"] < 1.0


def test_without_a_run_it_says_so(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    assert run(["monitor"]) == 3
    assert "no ground station is running here" in capsys.readouterr().err
