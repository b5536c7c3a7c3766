"""A driver process killed or frozen in flight without a failsafe sender: the vehicles stop by themselves."""

import math
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import mavlink_hangar
import numpy as np
import pytest

pytestmark = [pytest.mark.sitl, pytest.mark.slow, pytest.mark.timeout(180)]
HERE = Path(__file__).parent
hangar, port = mavlink_hangar.hangar, mavlink_hangar.port

# PX4: COM_OF_LOSS_T 1.0 s plus a measured delay, then it lands. ArduPilot: GUID_TIMEOUT 0.5 s, then it brakes;
# FS_GCS_TIMEOUT 2 s, then it lands. Add the braking time, and that of one heartbeat.
STOPPED_S = {"px4": 2.5, "ardupilot": 2.2}
LANDS_S = {"px4": 3.5, "ardupilot": 4.0}


def until(condition, seconds, what):
    deadline = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < deadline, f"never: {what()}"
        time.sleep(0.01)


def speed(copter):
    return math.hypot(*copter.airframe.velocity_stabilized())


@pytest.mark.parametrize(
    ("number", "link"),
    [
        (signal.SIGKILL, "mavsdk"),
        pytest.param(signal.SIGSTOP, "pymavlink", marks=pytest.mark.exhaustive),
        pytest.param(signal.SIGKILL, "pymavlink", marks=pytest.mark.exhaustive),
        pytest.param(signal.SIGSTOP, "mavsdk", marks=pytest.mark.exhaustive),
    ],
    ids=lambda value: getattr(value, "name", value),
)
def test_each_flavour_stops_by_its_own_time_out(hangar, port, link, number, tmp_path):
    place = ("127.0.0.1", port)
    flown = {}
    for flavour, system in (("px4", 11), ("ardupilot", 12)):
        # Poses continue: the silence of setpoints and heartbeat must take effect, not that of the cameras.
        flown[flavour] = hangar.add(flavour, system, calls=place, aided=True)[:2]
    places = np.memmap(tmp_path / "places", dtype=float, mode="w+", shape=(len(flown), 4))
    with (tmp_path / "pilot.txt").open("wb") as sink:
        command = [sys.executable, str(HERE / "mavlink_pilot.py"), str(port), link, str(tmp_path / "places")]
        pilot = subprocess.Popen(command, stdout=sink, stderr=sink)
    try:
        said = lambda: [(f, e.firmware.mode, round(speed(c), 2), c.airframe.z) for f, (e, c) in flown.items()]  # noqa: E731

        def moving():
            for place, (_, copter) in zip(places, flown.values(), strict=True):
                body = copter.airframe
                place[:] = body.x, body.y, body.z, body.yaw
            return all(c.airborne and c.airframe.z > 0.5 and speed(c) > 0.25 for _, c in flown.values())

        until(moving, 60, lambda: (said(), (tmp_path / "pilot.txt").read_text()[-2000:]))
        os.kill(pilot.pid, number)
        at_s = {flavour: emulator.firmware.now_s for flavour, (emulator, _) in flown.items()}
        tracks: dict[str, list[tuple[float, tuple[float, float], object]]] = {flavour: [] for flavour in flown}

        def landed():
            for flavour, (emulator, copter) in flown.items():
                # In the vehicle's own time: its time-outs count, not the speed at which this machine simulates it.
                body, firmware = copter.airframe, emulator.firmware
                tracks[flavour].append((firmware.now_s - at_s[flavour], (body.x, body.y), firmware.mode))
            return not any(e.firmware.armed or c.airborne for e, c in flown.values())

        until(landed, 90, said)
        for flavour, (emulator, _) in flown.items():
            begin = STOPPED_S[flavour]
            second = [place for at, place, _ in tracks[flavour] if begin <= at <= begin + 1.0]
            assert second, "no sample of that second"
            drift_m = math.dist(second[0], second[-1])
            assert drift_m < 0.25, f"{flavour} still flies: {drift_m:.2f} m within a second"
            lands_s = next(at for at, _, mode in tracks[flavour] if mode == emulator.firmware.landing)
            assert lands_s < LANDS_S[flavour], f"{flavour} lands after {lands_s:.1f} s only"
    finally:
        os.kill(pilot.pid, signal.SIGCONT) if pilot.poll() is None else None
        pilot.kill()
        pilot.wait()
