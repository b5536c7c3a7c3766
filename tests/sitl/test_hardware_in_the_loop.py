"""`sitl --real`: an unmodified firmware in an otherwise emulated room; stops reach both."""

import signal
import sys
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import ClassVar

import numpy as np
import pytest

from drivers.mavlink.parameters import needed
from drivers.mavlink.wire.names import Flavour
from sim_bridge.devices.captured_bodies import CapturedBodies
from sim_bridge.devices.natnet import NatnetEmulator
from sim_bridge.site import SiteCapture

sys.path.insert(0, str(Path(__file__).parent))  # for the helper modules of this folder
from firmware import VARIABLES, Firmware, binary_of
from real_parts import STAND_IN, Run, field, heights, stand_in, started, true_poses
from spare_time import needing_processors

__all__ = ["stand_in", "started"]  # fixtures
pytestmark = [pytest.mark.slow, pytest.mark.sitl, pytest.mark.timeout(400)]
SYSTEM = 8
# The whole team beside a firmware takes 2.3 cores (in step any computer can fly it: test_firmware_in_step.py).
TWO_DRONES = ("--set", "drones.drone_3=null")
LITTLE_RECORDED = ("--set", "recording.raw_datagrams=false", "--set", "recording.pictures=none")


@pytest.mark.usefixtures("stand_in")
def test_a_foreign_firmware_flies_in_the_team_and_ctrl_c_lands_it_with_the_others(
    tmp_path: Path, started: Callable[..., Run]
) -> None:
    path = field(tmp_path, "flavour: ardupilot, system_id: 1", STAND_IN)
    run = started(path, "--real", "drone_2=autopilot:25648", *TWO_DRONES, *LITTLE_RECORDED)
    run.until("To take off and track press Enter", 120)
    time.sleep(3.0)
    assert max(heights(tmp_path)) < 0.1, "nobody takes off unasked"
    run.press_enter()
    with needing_processors():
        run.until("drone_2: TRACK sent / received / accepted / effective", 90)
        time.sleep(10.0)
        assert heights(tmp_path)[-1] > 0.5
    run.process.send_signal(signal.SIGINT)
    run.until("all drones have landed", 40)
    run.process.wait(60)
    assert heights(tmp_path)[-1] < 0.1
    report = run.report()
    assert report["landed"] and report["target_rmse_m"] <= 0.15, run.said


class Hall(threading.Thread):
    """Motion capture of the stand-in's hall: its server streams the one body that is there.

    The other drone is emulated, and located by emulated ranges: without pictures of fixed cameras, which cost the most.
    """

    BOX: ClassVar = {"x_m": (-3.5, 3.5), "y_m": (-2.6, 2.6), "z_m": (-0.1, 2.7)}
    PLACE = ("127.95.1.7", 25651)
    OPTIONS = ("--set", "drones.drone_3=null", "--set", "cameras=null")

    def __init__(self) -> None:
        super().__init__(daemon=True)
        self._truth = true_poses()
        self._row, self._over = np.full((1, 13), np.nan), threading.Event()
        system = SiteCapture.model_validate({"volume_m": self.BOX})
        rng = np.random.default_rng(1)
        bodies = CapturedBodies("mocap", system, ["drone_2"], lambda: self._row, rng, errors=False)
        self._server = NatnetEmulator("mocap", self.PLACE, bodies)

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


@pytest.mark.firmware
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
        real = f"drone_2=autopilot:{firmware.truth_port}"
        run = started(path, "--real", real, "--duration", "40", *TWO_DRONES)
        run.until("To take off and track press Enter", 120)
        if "drone_2 would be left out" in run.said:  # its estimator needs longer to start than the others
            run.until("nobody would be left out any more", 60)
        run.press_enter()
        run.process.wait(200)
        report = run.report()
        assert report["landed"] and report["target_rmse_m"] <= 0.05, run.said
        assert report["passed"] and report["robots"].keys() == {"drone_1", "drone_2"}, run.said
    finally:
        firmware.end()
