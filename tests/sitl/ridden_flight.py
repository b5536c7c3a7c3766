"""Two emulated vehicles, flown by the real driver in its own process and forwarded to a second ground station."""

import math
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import mavlink_hangar
import numpy as np
from arrival_times import ANCILLARY, ArrivalTimes

from drivers.mavlink.wire.flight import SetPositionTargetLocalNed
from drivers.mavlink.wire.frames import id_of
from drivers.mavlink.wire.verification import number_of

HERE = Path(__file__).parent
hangar, port = mavlink_hangar.hangar, mavlink_hangar.port

FLAVOURS = {"px4": 11, "ardupilot": 12}
VEHICLE_WAITS_S = 0.5  # GUID_TIMEOUT: after it an ArduPilot brakes
UNEVEN = 1.5  # random share of the 99th percentile of some 80 gaps
_FLIES_M_S = 0.25


class TimedSocket:
    """An emulator's socket that records the arrival times of setpoints [s]."""

    def __init__(self, udp: Any) -> None:
        self._udp, self._times, self.setpoints_s = udp, ArrivalTimes(udp), list[float]()

    def recvfrom(self, size: int) -> tuple[bytes, Any]:
        data, notes, _, source = self._udp.recvmsg(size, ANCILLARY)
        if number_of(data) == id_of(SetPositionTargetLocalNed):
            self.setpoints_s.append(self._times.of(notes))
        return data, source

    def __getattr__(self, name: str) -> Any:
        return getattr(self._udp, name)

    def gaps_s(self, since: float, until: float) -> Any:
        return np.diff([at for at in self.setpoints_s if since <= at < until])


class RiddenFlight:
    """`wires` and `vehicles` (emulator, body) by system id; `log`: the driver's messages to its operator."""

    def __init__(self, hangar: Any, port: int, folder: Path) -> None:
        self.vehicles = {
            system: hangar.add(flavour, system, calls=("127.0.0.1", port), aided=True)[:2]
            for flavour, system in FLAVOURS.items()
        }
        self.wires = {}
        for system, (emulator, _) in self.vehicles.items():
            self.wires[system] = emulator.socket = TimedSocket(emulator.socket)
        self.places = np.memmap(folder / "places", dtype=float, mode="w+", shape=(len(self.vehicles), 4))
        self._told, self._ended = folder / "pilot.txt", threading.Event()
        threading.Thread(target=self._locate, daemon=True).start()

    def _locate(self) -> None:
        while not self._ended.wait(0.01):
            for place, (_, copter) in zip(self.places, self.vehicles.values(), strict=True):
                body = copter.airframe
                place[:] = body.x, body.y, body.z, body.yaw

    @property
    def log(self) -> str:
        return self._told.read_text() if self._told.exists() else ""

    def speed(self, system: int) -> float:
        return math.hypot(*self.vehicles[system][1].airframe.velocity_stabilized())

    def airborne(self, system: int) -> bool:
        return bool(self.vehicles[system][1].airborne)

    def until(self, condition: Callable[[], bool], seconds: float) -> None:
        deadline = time.monotonic() + seconds
        while not condition():
            speeds = {system: self.speed(system) for system in self.vehicles}
            assert time.monotonic() < deadline, f"never: speeds {speeds}\n{self.log[-2000:]}"
            time.sleep(0.01)

    def end(self) -> None:
        self._ended.set()


@contextmanager
def ridden(hangar: Any, port: int, folder: Path, rider: int, *allowed: str) -> Iterator[RiddenFlight]:
    """Fly both vehicles forward at 0.4 m/s, forwarded to a port; allowed: the rider's rights besides look and stop."""
    flight = RiddenFlight(hangar, port, folder)
    order = [str(HERE / "mavlink_pilot.py"), str(port), "pymavlink", str(folder / "places"), str(rider), *allowed]
    with (folder / "pilot.txt").open("wb") as sink:
        pilot = subprocess.Popen([sys.executable, *order], stdout=sink, stderr=sink)
    try:
        flight.until(lambda: min(map(flight.speed, flight.vehicles)) > _FLIES_M_S, 60)
        yield flight
    finally:
        flight.end()
        pilot.kill()
        pilot.wait()


def described(gaps_s: Any) -> str:
    return f"{len(gaps_s)}, 99 % within {np.percentile(gaps_s, 99) * 1e3:.0f} ms, all {max(gaps_s) * 1e3:.0f} ms"


def is_on_time(quiet: Any, ridden: Any) -> bool:
    """Return whether gaps between setpoints are as regular as without a rider."""
    return bool(np.percentile(ridden, 99) <= UNEVEN * np.percentile(quiet, 99) and max(ridden) < VEHICLE_WAITS_S)
