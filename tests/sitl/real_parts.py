"""The mixed team with one real drone or camera: its field, `groundstation sitl --real`, and a stand-in.

Without a SITL binary an emulated vehicle in its own process stands for the firmware: it sends its true state and is
flown by external poses. It prints the truth for judging.
"""

import json
import math
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any

import pytest
from sitl_run import FEW_PICTURES

from sim_bridge.real.mavlink_truth import AutopilotTruth
from sim_bridge.real.placed import Placement

ROOT = Path(__file__).parents[2]
STAND_IN = "127.95.1.2"
TRUTH = ("127.0.0.1", 25648)
PAD_M, PAD_YAW_RAD = (-0.45, -0.5), math.radians(48.0)
GROUND = (sys.executable, "-m", "groundstation")
# Fourteen processes beside a firmware: two cores cannot render as many pictures as a lab takes.
FEW = ("--scenario", str(FEW_PICTURES), "--set", "planner.rate_hz=5", "--set", "recording.image_fps=1")


def field(folder: Path, mavlink: str, address: str = "127.0.0.1", **sources: str) -> Path:
    """Write the mixed team with drone_2 at another address, and cameras with other sources."""
    text = (ROOT / "config" / "mixed-team.yaml").read_text()
    text = text.replace("mavlink: {flavour: px4, system_id: 11, link: mavsdk}", f"mavlink: {{{mavlink}}}")
    text = text.replace("address: 192.168.1.12", f"address: {address}")
    for was, source in sources.items():
        text = text.replace(f"http://192.168.1.{was.removeprefix('of_')}:8080/video.mjpg", source)
    (folder / "cameras").symlink_to(ROOT / "config" / "cameras")
    path = folder / "team.yaml"
    path.write_text(text)
    return path


class Run:
    """`groundstation sitl` with a keyboard for the test's input; `said` is its output so far."""

    def __init__(self, path: Path, *arguments: str) -> None:
        self.folder = path.parent
        pipe = subprocess.PIPE
        options = ("--headless", "--seed", "1", "--output", str(self.folder), *FEW)
        command = [*GROUND, "sitl", str(path), *options, *arguments]
        self.process = subprocess.Popen(
            command, stdin=pipe, stdout=pipe, stderr=subprocess.STDOUT, text=True, cwd=self.folder
        )
        self.said = ""
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()

    def _read(self) -> None:
        for line in self.process.stdout or ():
            self.said += line

    def until(self, text: str, seconds: float) -> None:
        deadline = time.monotonic() + seconds
        while text not in self.said:
            assert self.process.poll() is None and time.monotonic() < deadline, f"never said {text!r}:\n{self.said}"
            time.sleep(0.1)

    def press_enter(self) -> None:
        assert self.process.stdin is not None
        self.process.stdin.write("\n")
        self.process.stdin.flush()

    @property
    def run_folder(self) -> Path:
        (run,) = [path for path in self.folder.iterdir() if (path / "report.json").exists()]
        return run

    def report(self) -> dict[str, Any]:
        judged: dict[str, Any] = json.loads((self.run_folder / "report.json").read_text())
        if not judged["valid"]:
            pytest.skip(f"{'; '.join(judged['reasons'])}: nothing is shown")
        return judged

    def close(self) -> None:
        for patience in (40, 10):
            if self.process.poll() is None:
                self.process.send_signal(signal.SIGINT)
                with suppress(subprocess.TimeoutExpired):
                    self.process.wait(patience)
        self.process.kill()
        self.process.wait()
        self._reader.join(10.0)
        for pipe in (self.process.stdin, self.process.stdout):
            if pipe is not None:
                pipe.close()


@pytest.fixture
def started() -> Iterator[Callable[..., Run]]:
    runs: list[Run] = []

    def start(*arguments: Any) -> Run:
        runs.append(Run(*arguments))
        return runs[-1]

    yield start
    for run in runs:
        run.close()


@pytest.fixture
def stand_in(tmp_path: Path) -> Iterator[list[dict[str, Any]]]:
    """An emulated ArduPilot in its own process; at the end, the true states that it printed."""
    states: list[dict[str, Any]] = []
    command = [sys.executable, "-m", "sim_bridge.standalone", f"ardupilot@{STAND_IN}", "--indoor", "--truth"]
    with (tmp_path / "truth.txt").open("w") as sink:
        process = subprocess.Popen([*command, "--truth-to", "{}:{}".format(*TRUTH)], stdout=sink, cwd=ROOT)
    yield states
    process.terminate()
    process.wait(10)
    states += [json.loads(line)["drones"] for line in (tmp_path / "truth.txt").read_text().splitlines()]


def places(folder: Path) -> list[tuple[float, float, float]]:
    lines = [line for line in (folder / "truth.txt").read_text().splitlines() if line.endswith("}}}")]
    return [tuple(drone["position"]) for line in lines for drone in json.loads(line)["drones"].values()]


def heights(folder: Path) -> list[float]:
    return [place[2] for place in places(folder)]


def true_poses() -> AutopilotTruth:
    """Receive the stand-in's true poses in the room."""
    return AutopilotTruth("drone_2", TRUTH, 1, Placement(PAD_M, PAD_YAW_RAD))
