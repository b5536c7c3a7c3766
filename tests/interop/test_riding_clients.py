"""Third-party ground stations with their defaults as second station: they observe and stop, and fly nothing."""

import asyncio
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest
from mavsdk.asyncio import ComponentType, Configuration, Mavsdk
from mavsdk.asyncio.plugins.action import ActionAsync
from mavsdk.asyncio.plugins.telemetry import TelemetryAsync

sys.path.insert(0, str(Path(__file__).parents[1] / "sitl"))  # the flight that they observe as second station
from free_port import free_port
from ridden_flight import FLAVOURS, RiddenFlight, described, hangar, is_on_time, port, ridden
from spare_time import needing_processors

__all__ = ["hangar", "port"]  # fixtures

pytestmark = [pytest.mark.slow, pytest.mark.interop, pytest.mark.timeout(150)]

PX4, ARDUPILOT = FLAVOURS["px4"], FLAVOURS["ardupilot"]
QUIET_S, RIDDEN_S = 6.0, 12.0
STANDS_M_S = 0.15
_ANSWERED_S = 2.0
# DO_REPOSITION to nowhere, as QGroundControl pauses a PX4.
PAUSE = "long DO_REPOSITION -1 1 0 nan nan nan nan"
DENIED = "Got COMMAND_ACK: {}: DENIED"


class Proxy:
    """MAVProxy at its prompt."""

    def __init__(self, process: "subprocess.Popen[str]", output: Path) -> None:
        self._process, self._output, self._read = process, output, 0

    @property
    def said(self) -> str:
        return self._output.read_text(errors="replace")

    def order(self, line: str) -> None:
        self._read = len(self.said)
        assert self._process.stdin is not None
        print(line, file=self._process.stdin, flush=True)

    def until(self, text: str, seconds: float = 15.0) -> None:
        """Wait for this output since the last command."""
        deadline = time.monotonic() + seconds
        while text not in self.said[self._read :]:
            assert time.monotonic() < deadline, f"never said {text!r}:\n{self.said}"
            time.sleep(0.05)


@contextmanager
def proxy_on(python: Path, port: int, folder: Path) -> Iterator[Proxy]:
    """Start MAVProxy with no option but its master."""
    command = [str(python), "-u", str(python.with_name("mavproxy.py")), f"--master=udpin:127.0.0.1:{port}"]
    output = folder / "mavproxy.txt"
    with (
        output.open("wb") as sink,
        subprocess.Popen(
            [*command, "--state-basedir", str(folder)], stdin=subprocess.PIPE, stdout=sink, stderr=sink, text=True
        ) as process,
    ):
        try:
            yield Proxy(process, output)
        finally:
            process.kill()


@needing_processors()
def test_mavproxy_sees_both_vehicles_is_refused_what_flies_and_stops_them(
    hangar: Any, port: int, tmp_path: Path, interpreter: Callable[[str], Path]
) -> None:
    python, riding = interpreter("mavproxy"), free_port(kind=socket.SOCK_DGRAM)
    with ridden(hangar, port, tmp_path, riding, "parameters") as flight:
        began_s = time.monotonic()
        time.sleep(QUIET_S)
        ridden_s = time.monotonic()
        with proxy_on(python, riding, tmp_path) as proxy:
            for system in FLAVOURS.values():
                proxy.until(f"Detected vehicle {system}:1")
            for system in FLAVOURS.values():
                proxy.until(f"mav_{system}_1.parm", 30.0)  # the file of all saved parameters
            proxy.order(f"vehicle {ARDUPILOT}")
            for line, command in (("arm throttle", "COMPONENT_ARM_DISARM"), ("takeoff 3", "NAV_TAKEOFF")):
                proxy.order(line)
                proxy.until(DENIED.format(command))
            proxy.order("mode AUTO")
            proxy.until(DENIED.format("DO_SET_MODE"))
            proxy.order("rc 3 1900")
            assert_on_time(flight, began_s, ridden_s)
            stop_each(flight, proxy)


def assert_on_time(flight: RiddenFlight, began_s: float, ridden_s: float) -> None:
    time.sleep(max(0.0, ridden_s + RIDDEN_S - time.monotonic()))
    for wire in flight.wires.values():
        quiet, busy = wire.gaps_s(began_s, ridden_s), wire.gaps_s(ridden_s, time.monotonic())
        figures = f"gaps without and with MAVProxy: {described(quiet)}; {described(busy)}"
        print(figures)
        assert is_on_time(quiet, busy), figures


def stop_each(flight: RiddenFlight, proxy: Proxy) -> None:
    """Pause and land each vehicle from the prompt; check the effect in both places."""
    for system, kind, pause, mode, landing in (
        (ARDUPILOT, "pause", "pause", "BRAKE", "mode LAND"),
        (PX4, "pause", PAUSE, "LOITER", "long DO_SET_MODE 157 4 6"),
    ):
        proxy.order(f"vehicle {system}")
        proxy.until(f"vehicle {system}")
        proxy.order(pause)
        proxy.until(f"Mode {mode}")
        flight.until(lambda system=system: flight.speed(system) < STANDS_M_S, 10)
        flight.until(
            lambda system=system, kind=kind: f"v{system}: a second ground station stops it ({kind})" in flight.log, 10
        )
        proxy.order(landing)
        proxy.until("Mode LAND")
        flight.until(lambda system=system: not flight.airborne(system), 20)
        flight.until(lambda system=system: f"v{system}: a second ground station stops it (LAND)" in flight.log, 10)


async def ride_with_mavsdk(port: int, flight: RiddenFlight) -> dict[int, str]:
    """Hold and land all vehicles; returns the result of a take-off command."""
    answers = {}
    async with Mavsdk(Configuration.create_with_component_type(ComponentType.GROUND_STATION)) as mavsdk:
        await mavsdk.add_any_connection(f"udpin://127.0.0.1:{port}")
        deadline = time.monotonic() + 20.0
        while len(await mavsdk.get_systems()) < len(FLAVOURS):
            assert time.monotonic() < deadline, "one vehicle was not found"
            await asyncio.sleep(0.1)
        for system in await mavsdk.get_systems():
            number, action, telemetry = await system.get_system_id(), ActionAsync(system), TelemetryAsync(system)
            while not await telemetry.in_air():
                assert time.monotonic() < deadline, "it is not seen to fly"
                await asyncio.sleep(0.1)
            answers[number] = await answer_of(action.takeoff())
            # It repeats a command after half a second, and takes a second refusal of a mode as the next command's.
            await asyncio.sleep(_ANSWERED_S)
            await action.hold()
            await asyncio.to_thread(flight.until, lambda n=number: flight.speed(n) < STANDS_M_S, 10)
            await action.land()
            await asyncio.to_thread(flight.until, lambda n=number: not flight.airborne(n), 20)
    return answers


async def answer_of(asked: Any) -> str:
    try:
        await asked
    except Exception as error:  # noqa: BLE001 - whatever it is, its text is what the user reads
        return str(error)
    return "accepted"


@pytest.mark.exhaustive
def test_mavsdk_sees_both_vehicles_is_refused_a_take_off_and_stops_them(hangar: Any, port: int, tmp_path: Path) -> None:
    riding = free_port(kind=socket.SOCK_DGRAM)
    with ridden(hangar, port, tmp_path, riding) as flight:
        answers = asyncio.run(ride_with_mavsdk(riding, flight))
        assert set(answers) == set(FLAVOURS.values())
        assert all("denied" in answer.lower() for answer in answers.values()), answers
        for system in FLAVOURS.values():
            assert f"v{system}: a second ground station stops it (LAND)" in flight.log
