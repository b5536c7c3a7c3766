"""Round trips over a plain bus and over one with certificates and a traced access list, in turn in the same run."""

import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from groundstation.bench.bus_peer import DRIVER, DRONE, ROUTER, SITE, TRACKER, identity
from groundstation.bus.messages import VelocitySetpoint
from groundstation.bus.topics import ODOMETRY, SETPOINT
from groundstation.bus.zenoh_bus import ZenohBus, open_bus
from groundstation.errors import GroundStationError
from groundstation.process.ports import free_port
from groundstation.supervisor.authority import make_identities

HOST = "127.0.0.1"
_WARM_UP, _ANSWER_S = 50, 0.2


def measure(trips: int, rate_hz: float) -> dict[str, Any]:
    """Return the times [ms] of round trips tracker - router - driver - router - tracker, by bus, and their ratio."""
    with tempfile.TemporaryDirectory() as temporary, ExitStack() as stack:
        folder = Path(temporary) / "keys"
        make_identities(folder, [HOST], [ROUTER, TRACKER.name, DRIVER.name])
        ways = {"plain": (f"tcp/{HOST}:{free_port()}", "-"), "guarded": (f"tls/{HOST}:{free_port()}", str(folder))}
        for way in ways.values():
            stack.enter_context(_peer(ROUTER, *way))
        stack.enter_context(_peer("echo", *(word for way in ways.values() for word in way)))
        buses = {name: _joined(stack, *way) for name, way in ways.items()}
        times = _round_trips(buses, trips, 1.0 / rate_hz)
    figures: dict[str, Any] = {
        f"{name}_{label}_ms": round(float(np.percentile(found, share)), 3)
        for name, found in times.items()
        for label, share in (("p50", 50), ("p99", 99))
    }
    figures["ratio_p50"] = round(figures["guarded_p50_ms"] / figures["plain_p50_ms"], 2)
    figures["lost"] = 2 * trips - sum(map(len, times.values()))
    return figures


def _joined(stack: ExitStack, endpoint: str, folder: str) -> ZenohBus:
    bus = open_bus(endpoint, SITE, TRACKER.name, 5.0, identity(folder, TRACKER.name))
    stack.callback(bus.close)
    return bus


@contextmanager
def _peer(*arguments: str) -> Iterator[None]:
    command = [sys.executable, "-m", "groundstation.bench.bus_peer", *arguments]
    peer = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
    assert peer.stdin is not None and peer.stdout is not None
    try:
        if not any(line == "ready\n" for line in peer.stdout):
            raise GroundStationError(f"the {arguments[0]} of the bench did not start")
        yield
    finally:
        peer.stdin.close()
        try:
            peer.wait(5)
        except subprocess.TimeoutExpired:
            peer.kill()
            peer.wait()
        peer.stdout.close()


def _round_trips(buses: dict[str, ZenohBus], trips: int, period_s: float) -> dict[str, list[float]]:
    answers = {name: bus.subscribe([ODOMETRY], entity=DRONE) for name, bus in buses.items()}
    times: dict[str, list[float]] = {name: [] for name in buses}
    for number in range(_WARM_UP + trips):
        for name, bus in buses.items():
            began = time.perf_counter()
            message = VelocitySetpoint(
                header=bus.header(DRONE), velocity_m_s=(0.1, 0.0, 0.0), yaw_rate_rad_s=0.0, lifetime_ms=300, epoch=1
            )
            bus.publish(SETPOINT, message)
            answered = answers[name].wait(_ANSWER_S) and bool(answers[name].drain())
            took = time.perf_counter() - began
            if answered and number >= _WARM_UP:
                times[name].append(1000 * took)
            elif not answered and number == _WARM_UP:
                raise GroundStationError(f"no answer came over the {name} bus")
            time.sleep(max(0.0, period_s / len(buses) - took))
    return times
