"""Faults of recorder, cameras, renderer, disk and terminal do not affect the flight."""

import os
import pty
import select
import signal
import subprocess
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any

import pytest

from groundstation.recording.reader import open_recording

pytestmark = [pytest.mark.sitl, pytest.mark.slow, pytest.mark.timeout(240)]
Start = Callable[..., Any]


def _fly_on(run: Any, seconds: float) -> None:
    since = time.monotonic()
    run.until(lambda: time.monotonic() > since + seconds, seconds + 5)
    for drone in run.record.drones:
        assert set(run.modes_since(drone, since)) == {"TRACK"}


def _renderers(bridge: int) -> list[int]:
    children = Path(f"/proc/{bridge}/task/{bridge}/children").read_text().split()
    return [int(pid) for pid in children if b"spawn_main" in Path(f"/proc/{pid}/cmdline").read_bytes()]


def test_killed_recorder_and_camera_come_back_while_the_drones_track(sitl: Start) -> None:
    run = sitl()
    run.until_tracking()
    pids = {name: run.pid(name) for name in ("recorder", "drone_1_camera", "console")}
    for pid in pids.values():
        os.kill(pid, signal.SIGKILL)
    _fly_on(run, 2)
    run.until(lambda: all(run.restarted(name, pid) for name, pid in pids.items()), 20, "all back")
    _fly_on(run, 1)
    run.process.send_signal(signal.SIGTERM)
    assert run.wait(40) == 0
    run.until_gone(5)
    parts = sorted(path.name for path in run.run_dir.glob("state*.mcap"))
    assert parts == ["state-2.mcap", "state.mcap"]
    assert not open_recording(run.run_dir / "state-2.mcap").damage


@pytest.mark.exhaustive
def test_killed_renderer_ends_or_heals_but_never_hides(sitl: Start) -> None:
    run = sitl()
    run.until_tracking()
    victim = _renderers(run.pid("sim_bridge"))[0]
    os.kill(victim, signal.SIGKILL)
    run.until(lambda: run.process.poll() is not None or "no picture" in " ".join(run.events()), 10, "named")
    run.process.send_signal(signal.SIGTERM)
    run.wait(40)
    run.until_gone(5)


@pytest.fixture
def small_disk(tmp_path: Path) -> Iterator[Path]:
    """A disk with room for the start and little more."""
    disk = tmp_path / "disk"
    disk.mkdir()
    mounted = subprocess.run(
        ["mount", "-t", "tmpfs", "-o", "size=60m", "tmpfs", str(disk)], capture_output=True, check=False
    )
    if mounted.returncode:
        pytest.skip("mounting a small disk needs root")
    yield disk
    subprocess.run(["umount", "--lazy", str(disk)], check=True)


def test_full_disk_stops_the_recording_but_neither_flight_nor_restarts(sitl: Start, small_disk: Path) -> None:
    run = sitl("--output", str(small_disk))
    run.until_tracking()
    with suppress(OSError), (small_disk / "filler").open("wb", buffering=0) as filler:
        while True:
            filler.write(bytes(65_536))
    since = time.monotonic()
    _fly_on(run, 3)
    assert any("recorder" in event and ("No space" in event or "MB left" in event) for event in run.events())
    camera = run.pid("drone_1_camera")
    os.kill(camera, signal.SIGKILL)
    run.until(lambda: run.restarted("drone_1_camera", camera), 45, "camera back")
    for drone in run.record.drones:
        assert set(run.modes_since(drone, since)) == {"TRACK"}
    run.process.send_signal(signal.SIGTERM)
    run.until_landed(20)
    run.wait(40)
    assert "Traceback" not in run.text
    assert "the report cannot be written" in run.text and "criterion" in run.text
    run.until_gone(5)


@pytest.mark.exhaustive
def test_closed_terminal_lands_and_finishes_the_recording(sitl: Start) -> None:
    master, terminal = pty.openpty()
    closing = threading.Event()
    reader = threading.Thread(target=_read_until, args=(master, closing))
    reader.start()
    run = sitl(terminal=terminal)
    os.close(terminal)
    run.until_tracking()
    closing.set()
    reader.join()
    os.close(master)
    run.until_landed(20)
    assert run.wait(30) == 0
    run.until_gone(5)
    assert (run.run_dir / "report.json").is_file()
    assert not open_recording(run.run_dir / "state.mcap").damage


def _read_until(master: int, closing: threading.Event) -> None:
    while not closing.is_set():
        if select.select([master], [], [], 0.1)[0]:
            os.read(master, 65_536)
