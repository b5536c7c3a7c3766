"""`sitl --real`: a firmware of its own, and a camera of its own, in an otherwise emulated room; stops reach both.

Without a SITL binary an emulated vehicle in a process of its own stands for the firmware: it sends its true state and
is flown by poses from outside. What it prints is the truth that judges.
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
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any, ClassVar

import cv2
import numpy as np
import pytest

from drivers.mavlink.parameters import needed
from drivers.mavlink.wire.names import Flavour
from sim_bridge.devices.natnet import NatnetEmulator
from sim_bridge.real.mavlink_truth import AutopilotTruth
from sim_bridge.real.placed import Placement
from sim_bridge.site import SiteCapture

HERE, ROOT = Path(__file__).parent, Path(__file__).parents[2]
sys.path.insert(0, str(HERE))  # what lies here and is no test belongs to these tests
from firmware import VARIABLES, Firmware, binary_of  # noqa: E402
from sitl_run import FEW_PICTURES  # noqa: E402

pytestmark = [pytest.mark.slow, pytest.mark.sitl, pytest.mark.firmware, pytest.mark.timeout(400)]
SYSTEM = 8
STAND_IN = "127.95.1.2"
GROUND = (sys.executable, "-m", "groundstation")
# Fourteen processes beside a firmware: two cores have no room for the pictures that a lab would take.
FEW = ("--scenario", str(FEW_PICTURES), "--set", "planner.rate_hz=5", "--set", "recording.image_fps=1")


def field(folder: Path, mavlink: str, address: str = "127.0.0.1", **sources: str) -> Path:
    """Write the mixed team with drone_2 at another place, and cameras with other sources."""
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
    """`groundstation sitl` with a keyboard that the test types on; `said` is what it printed so far."""

    def __init__(self, path: Path, *arguments: str) -> None:
        self.folder = path.parent
        pipe = subprocess.PIPE
        options = ("--headless", "--seed", "1", "--report", str(self.folder), *FEW)
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

    def report(self) -> dict[str, Any]:
        (run,) = [path for path in self.folder.iterdir() if (path / "report.json").exists()]
        judged: dict[str, Any] = json.loads((run / "report.json").read_text())
        if not judged["valid"]:
            pytest.skip("the simulator did not keep real time: nothing is shown")
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
    """An emulated ArduPilot in a process of its own; what it printed of its true state, in the end."""
    states: list[dict[str, Any]] = []
    command = [sys.executable, "-m", "sim_bridge.standalone", f"ardupilot@{STAND_IN}", "--indoor", "--truth"]
    with (tmp_path / "truth.txt").open("w") as sink:
        process = subprocess.Popen([*command, "--truth-to", "127.0.0.1:25648"], stdout=sink, cwd=ROOT)
    yield states
    process.terminate()
    process.wait(10)
    states += [json.loads(line)["drones"] for line in (tmp_path / "truth.txt").read_text().splitlines()]


def heights(folder: Path) -> list[float]:
    lines = [line for line in (folder / "truth.txt").read_text().splitlines() if line.endswith("}}}")]
    return [drone["position"][2] for line in lines for drone in json.loads(line)["drones"].values()]


@pytest.mark.usefixtures("stand_in")
def test_a_foreign_firmware_flies_in_the_team_and_ctrl_c_lands_it_with_the_others(
    tmp_path: Path, started: Callable[..., Run]
) -> None:
    path = field(tmp_path, "flavour: ardupilot, system_id: 1", STAND_IN)
    run = started(path, "--real", "drone_2=autopilot:25648")
    run.until("To take off and track press Enter", 120)
    time.sleep(3.0)
    assert max(heights(tmp_path)) < 0.1, "nobody takes off unasked"
    run.press_enter()
    run.until("drone_3: TRACK sent / received / accepted / effective", 90)
    time.sleep(10.0)
    assert heights(tmp_path)[-1] > 0.5
    run.process.send_signal(signal.SIGINT)
    run.until("all drones have landed", 40)
    run.process.wait(60)
    assert heights(tmp_path)[-1] < 0.1
    report = run.report()
    assert report["landed"] and report["target_rmse_m"] <= 0.15, run.said


class Hall(threading.Thread):
    """Motion capture of the hall that the stand-in flies in: its server streams the one body that is there.

    The other drone is emulated, and located by emulated ranges: no pictures of fixed cameras, which cost the most.
    """

    BOX: ClassVar = {"x_m": (-3.5, 3.5), "y_m": (-2.6, 2.6), "z_m": (-0.1, 2.7)}
    PLACE = ("127.95.1.7", 25651)
    OPTIONS = ("--set", "drones.drone_3=null", "--set", "cameras=null")

    def __init__(self) -> None:
        super().__init__(daemon=True)
        self._truth = AutopilotTruth("drone_2", ("127.0.0.1", 25648), 1, Placement((-0.45, -0.5), math.radians(48)))
        self._row, self._over = np.full((1, 13), np.nan), threading.Event()
        system = SiteCapture.model_validate({"volume_m": self.BOX})
        rng = np.random.default_rng(1)
        self._server = NatnetEmulator("mocap", self.PLACE, system, ["drone_2"], lambda: self._row, rng, errors=False)

    def run(self) -> None:
        begun, ticks = time.monotonic(), 0
        while not self._over.wait(max(0.0, begun + 0.005 * ticks - time.monotonic())):
            ticks += 1
            pose = self._truth.latest(time.monotonic_ns())
            if pose is not None:
                self._row = np.array([[*pose.position, *pose.velocity, *pose.attitude, *pose.rates, 0.0]])
            self._server.receive()
            self._server.send()

    def field(self, folder: Path) -> Path:
        path = field(folder, "flavour: ardupilot, system_id: 1", STAND_IN)
        box = ", ".join(f"{axis}: {list(span)}" for axis, span in self.BOX.items())
        capture = "motion_capture:\n  mocap:\n    source: natnet://{}:{}\n".format(*self.PLACE)
        anchors = "{a: [-3.9, -2.9, 2.9], b: [3.9, -2.9, 2.9], c: [3.9, 2.9, 2.9], d: [-3.9, 2.9, 0.3]}"
        radios = f"ranging:\n  uwb:\n    source: ranges://10.0.0.1\n    anchors: {anchors}\n"
        volume = f"    volume_m: {{{box}}}\n"
        path.write_text(path.read_text() + capture + volume + radios + volume)
        return path

    def close(self) -> None:
        self._over.set()
        self.join(5.0)
        self._server.close()
        self._truth.close()


@pytest.mark.exhaustive
@pytest.mark.usefixtures("stand_in")
def test_a_drone_that_motion_capture_follows_flies_in_the_team(tmp_path: Path, started: Callable[..., Run]) -> None:
    hall = Hall()
    hall.start()
    try:
        path = hall.field(tmp_path)
        run = started(path, "--real", "drone_2=mocap", "--duration", "12", *Hall.OPTIONS)
        run.until("To take off and track press Enter", 120)
        run.press_enter()
        run.until("drone_2: TRACK sent / received / accepted / effective", 90)
        run.process.wait(90)
        assert max(heights(tmp_path)) > 0.5 and heights(tmp_path)[-1] < 0.1
        report = run.report()
        assert report["landed"] and report["target_rmse_m"] <= 0.15, run.said
        assert "the room has it where mocap sees its body" in run.said
    finally:
        hall.close()


@pytest.mark.parametrize("flavour", ["px4", "ardupilot"])
def test_real_firmware_flies_in_the_team(flavour: str, tmp_path: Path, started: Callable[..., Run]) -> None:
    if not binary_of(flavour):
        pytest.skip(f"{VARIABLES[flavour]} names no SITL binary: none is in a package registry")
    folder = tmp_path / "firmware"
    folder.mkdir()
    wanted = {one.name: one.value for one in needed(Flavour[flavour.upper()], 255)}
    firmware = Firmware(flavour, folder, SYSTEM, wanted)
    try:
        listens = f"listen: true, local_address: 127.0.0.1, port: {firmware.port}"
        path = field(tmp_path, f"flavour: {flavour}, system_id: {SYSTEM}, {listens}")
        run = started(path, "--real", f"drone_2=autopilot:{firmware.truth_port}", "--duration", "40")
        run.until("To take off and track press Enter", 120)
        run.press_enter()
        run.process.wait(200)
        report = run.report()
        assert report["landed"] and report["target_rmse_m"] <= 0.05, run.said
    finally:
        firmware.end()


class Picture(BaseHTTPRequestHandler):
    """A camera of somebody else: one picture again and again, as MJPEG."""

    def do_GET(self) -> None:
        self.send_response(200)
        self.send_header("Content-Type", "multipart/x-mixed-replace; boundary=part")
        self.end_headers()
        grey = np.full((720, 1280), 110, np.uint8)
        jpeg = cv2.imencode(".jpg", grey)[1].tobytes()
        with suppress(OSError):
            while True:
                head = f"--part\r\nContent-Type: image/jpeg\r\nContent-Length: {len(jpeg)}\r\n\r\n"
                self.wfile.write(head.encode() + jpeg + b"\r\n")
                time.sleep(1 / 15)

    def log_message(self, *_: Any) -> None:
        pass


def test_emulated_drones_fly_beside_a_real_ceiling_camera(tmp_path: Path, started: Callable[..., Run]) -> None:
    server = ThreadingHTTPServer(("127.0.0.1", 0), Picture)
    server.daemon_threads = True
    threading.Thread(target=server.serve_forever, daemon=True).start()
    source = f"http://127.0.0.1:{server.server_address[1]}/video.mjpg"
    try:
        path = field(tmp_path, "flavour: px4, system_id: 11", of_50=source)
        run = started(path, "--real", "ceiling_west", "--duration", "15")
        run.process.wait(240)
        assert "ceiling_west is real and does not see what is emulated" in run.said
        assert f"pictures from {source}" in run.said, run.said
        assert run.report()["landed"], run.said
    finally:
        server.shutdown()
        server.server_close()
