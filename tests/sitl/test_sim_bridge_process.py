"""`python -m sim_bridge` as a process: start-up, truth on the bus, commands, and end."""

import itertools
import json
import os
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any

import pytest
from free_port import free_port

from groundstation.bus.messages import Lifecycle, ProcessStatus, SimCommand, SimStatus, TruthState
from groundstation.bus.topics import PROCESS_STATUS, SIM_COMMAND, SIM_STATUS, TRUTH
from groundstation.bus.zenoh_bus import ZenohBus, open_bus, open_router
from groundstation.supervisor.runtime_file import start_time

pytestmark = pytest.mark.sitl

_nets = itertools.count(1)
LENS = {
    "width_px": 320,
    "height_px": 180,
    "fx_px": 230.0,
    "fy_px": 230.0,
    "cx_px": 159.5,
    "cy_px": 89.5,
    "distortion": [0.0, 0.0, 0.0, 0.0, 0.0],
}


def free_net() -> str:
    pid = os.getpid()
    return f"127.{1 + pid % 250}.{50 + next(_nets)}"


class Site:
    """A router, a separate bus session, and the launch specification for one drone."""

    def __init__(self, folder: Path) -> None:
        self.net = free_net()
        address = f"{self.net}.1"
        self.endpoint = f"tcp/{address}:{free_port(address)}"
        self.router = open_router(self.endpoint)
        self.bus: ZenohBus = open_bus(self.endpoint, "lab", "test")
        self.subscription = self.bus.subscribe([TRUTH, SIM_STATUS, PROCESS_STATUS])
        self.spec = folder / "spec.json"
        self.processes: list[subprocess.Popen[str]] = []
        self.write()

    def write(self, **changes: Any) -> None:
        marker = {"code": 1, "square_mm": 44, "position_m": [0, 0, 0.08]}
        content = {
            "child": {"name": "sim_bridge", "role": "sim_bridge", "endpoint": self.endpoint, "site": "lab"},
            "field": {
                "site": "lab",
                "room": {"size_m": [8, 6, 4.5]},
                "cameras": {"ceiling": {"calibration": LENS, "position_m": [0, 0, 4.2]}},
                "drones": {"drone_1": {"kind": "ardrone", "pad_m": [0, 0], "marker": marker}},
                "target": {"name": "turtlebot", "marker": {"code": 5, "height_m": 0.4, "square_mm": 44}},
            },
            "scenario": {},
            "addresses": {"drone_1": f"{self.net}.11"},
            "streams": {},
            "seed": 1,
        }
        self.spec.write_text(json.dumps(content | changes))

    def start(self) -> "subprocess.Popen[str]":
        process = subprocess.Popen(
            [sys.executable, "-m", "sim_bridge", "--spec", str(self.spec)], stderr=subprocess.PIPE, text=True
        )
        self.processes.append(process)
        return process

    def await_ready(self) -> None:
        assert self.await_message(lambda m: isinstance(m, ProcessStatus) and m.state is Lifecycle.READY)

    def await_message(self, wanted: Callable[[Any], bool], timeout_s: float = 30.0) -> Any:
        deadline = time.monotonic() + timeout_s
        while time.monotonic() < deadline:
            for received in self.subscription.drain():
                if wanted(received.message):
                    return received.message
            time.sleep(0.01)
        return None

    def close(self) -> None:
        for process in self.processes:
            if process.poll() is None:
                process.kill()
            process.communicate(timeout=10)
        self.bus.close()
        self.router.close()


@pytest.fixture
def site(tmp_path: Path) -> Iterator[Site]:
    made = Site(tmp_path)
    yield made
    made.close()


def command(net: str, *lines: str) -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as udp:
        udp.sendto("".join(f"{line}\r" for line in lines).encode(), (f"{net}.11", 5556))


def test_it_serves_truth_and_ends_when_told(site: Site) -> None:
    process = site.start()
    site.await_ready()
    truth = site.await_message(lambda m: isinstance(m, TruthState) and m.header.entity == "turtlebot")
    assert truth.on_ground
    assert abs(truth.header.stamp_ns - time.monotonic_ns()) < 1e9
    status = site.await_message(lambda m: isinstance(m, SimStatus))
    assert (status.ticks, status.airborne) == (0, ()), "nothing flies yet, so no tick is judged"
    header = site.bus.header("turtlebot")
    site.bus.publish(SIM_COMMAND, SimCommand(header=header, action="place", position_m=(2.0, -1.0, 0.0)))
    assert site.await_message(lambda m: isinstance(m, TruthState) and abs(m.position_m[1] + 1.0) < 0.2)
    process.terminate()
    assert process.wait(5) == 0
    assert not list(Path("/dev/shm").glob(f"skein-truth-{process.pid}*"))


def test_a_taken_address_is_named(site: Site) -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as squatter:
        squatter.bind((f"{site.net}.11", 5556))
        process = site.start()
        _, said = process.communicate(timeout=20)
    assert process.returncode == 1
    assert f"{site.net}.11:5556" in said
    assert "Traceback" not in said


def test_a_wrong_scenario_is_refused_with_code_2(site: Site) -> None:
    site.write(scenario={"drones": {"velocity_gain": [0.9, 0.8], "hight_noise_m": 1}})
    process = site.start()
    _, said = process.communicate(timeout=20)
    assert process.returncode == 2
    assert "drones.velocity_gain" in said
    assert "drones.hight_noise_m" in said
    assert "Traceback" not in said


@pytest.mark.slow
def test_without_its_supervisor_it_stays_until_the_drone_has_landed(site: Site) -> None:
    """Started by an intermediate process that is killed: flies on, lands for silence, ends, and leaves no process."""
    site.write(streams={"ceiling": [f"{site.net}.50", 8080]})
    starter = (
        "import subprocess, sys, time\n"
        f"p = subprocess.Popen([sys.executable, '-m', 'sim_bridge', '--spec', {str(site.spec)!r}])\n"
        "print(p.pid, flush=True)\n"
        "time.sleep(120)\n"
    )
    supervisor = subprocess.Popen([sys.executable, "-c", starter], stdout=subprocess.PIPE, text=True)
    assert supervisor.stdout is not None
    bridge = int(supervisor.stdout.readline())
    try:
        site.await_ready()
        renderers = children(bridge)
        assert renderers
        for sequence in range(1, 60):
            command(site.net, f"AT*REF={sequence},512")
            if site.await_message(lambda m: isinstance(m, TruthState) and m.position_m[2] > 0.7, 0.2):
                break
        supervisor.kill()
        supervisor.wait()
        time.sleep(0.5)
        assert alive(bridge), "it must not leave a flying drone without a world"
        deadline = time.monotonic() + 15
        while alive(bridge) and time.monotonic() < deadline:
            time.sleep(0.05)
        assert not alive(bridge)
        time.sleep(0.5)
        assert not [pid for pid in renderers if alive(pid)]
    finally:
        supervisor.stdout.close()
        for pid in (bridge, *children(bridge)):
            with suppress(ProcessLookupError):
                os.kill(pid, signal.SIGKILL)


def test_a_killed_bridge_leaves_nobody(site: Site) -> None:
    site.write(streams={"ceiling": [f"{site.net}.50", 8080]})
    process = site.start()
    site.await_ready()
    family = children(process.pid)
    assert family
    process.kill()
    process.wait()
    deadline = time.monotonic() + 5
    while any(map(alive, family)) and time.monotonic() < deadline:
        time.sleep(0.05)
    assert not [pid for pid in family if alive(pid)]


def children(pid: int) -> list[int]:
    found = []
    for stat in Path("/proc").glob("[0-9]*/stat"):
        with suppress(OSError):
            fields = stat.read_text().rsplit(")", 1)[1].split()
            if int(fields[1]) == pid:
                found.append(int(stat.parent.name))
    return found


def alive(pid: int) -> bool:
    return start_time(pid) is not None
