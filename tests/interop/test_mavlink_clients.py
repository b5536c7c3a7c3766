"""Third-party programs fly the emulated MAVLink vehicles unmodified: connect with defaults, take off, land."""

import asyncio
import socket
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import pytest
from free_port import free_port
from mavsdk.asyncio import ComponentType, Configuration, Mavsdk
from mavsdk.asyncio.plugins.action import ActionAsync
from mavsdk.asyncio.plugins.mission_raw import MissionRawAsync
from mavsdk.asyncio.plugins.telemetry import TelemetryAsync

sys.path.insert(0, str(Path(__file__).parent))  # for the helper modules of this folder
from ground_station import GroundStation

pytestmark = [pytest.mark.slow, pytest.mark.interop, pytest.mark.timeout(150)]


def heights(hangar: Any) -> list[float]:
    return [drone["position"][2] for states in hangar.stop() for drone in states.values()]


def test_dronekit_flies_an_ardupilot(hangar: Any, programs: Any) -> None:
    place = f"127.0.0.1:{free_port(kind=socket.SOCK_DGRAM)}"
    drones = hangar(1, "--call", place, kind="ardupilot")
    seen = programs.result(programs.python("dronekit", "dronekit_flight.py", place))
    assert seen["parameters"] > 20 and seen["fix"] == 3
    flown = heights(drones)
    assert max(flown) == pytest.approx(1.5, abs=0.2) and flown[-1] < 0.1


def test_node_mavlink_flies_a_px4(hangar: Any, programs: Any) -> None:
    drones = hangar(1, kind="px4")
    seen = programs.result(programs.node("node_mavlink_flight.js", *drones.addresses, package="node-mavlink"))
    assert seen["disarmed"] and seen["acks"] == {"400": 0, "22": 0, "21": 0}
    flown = heights(drones)
    assert max(flown) == pytest.approx(2.5, abs=0.3) and flown[-1] < 0.1


@pytest.mark.parametrize("kind", ["px4", pytest.param("ardupilot", marks=pytest.mark.exhaustive)])
def test_traffic_like_qgroundcontrols_is_answered_and_flies(hangar: Any, kind: str) -> None:
    drones = hangar(1, kind=kind)
    station = GroundStation(drones.addresses[0], 14550)
    try:
        assert station.px4 == (kind == "px4")
        assert station.version().flight_sw_version >> 24 == (1 if station.px4 else 4)
        assert len(station.parameters()) > 20
        assert station.files_are_refused()
        assert station.mission_sizes() == [0, 0, 0]
        station.take_off(2.5)
        station.land()
    finally:
        station.close()
    flown = heights(drones)
    assert max(flown) == pytest.approx(2.5, abs=0.3) and flown[-1] < 0.1


async def fly_with_mavsdk(port: int) -> list[Any]:
    """Download the mission, take off and land, all with defaults; returns the mission's items."""
    async with Mavsdk(Configuration.create_with_component_type(ComponentType.GROUND_STATION)) as mavsdk:
        await mavsdk.add_any_connection(f"udpin://127.0.0.1:{port}")
        system = await mavsdk.first_autopilot(timeout_s=20.0)
        assert system is not None
        telemetry, action = TelemetryAsync(system), ActionAsync(system)
        items = await asyncio.wait_for(MissionRawAsync(system).download_mission(), 20.0)
        deadline = time.monotonic() + 20.0
        while not await telemetry.health_all_ok() and time.monotonic() < deadline:
            await asyncio.sleep(0.2)
        await action.arm()
        await action.takeoff()
        await asyncio.sleep(8.0)
        here = await telemetry.position()
        north = here.latitude_deg + 3.0 / 111_319.0
        await action.goto_location(north, here.longitude_deg, here.absolute_altitude_m, 0.0)
        await asyncio.sleep(6.0)
        assert abs((await telemetry.position()).latitude_deg - north) * 111_319.0 < 0.3
        await action.land()
        while await telemetry.armed() and time.monotonic() < deadline + 40.0:
            await asyncio.sleep(0.2)
        return list(items)


def test_mavsdk_finds_no_mission_and_flies_by_satellites(hangar: Any) -> None:
    port = free_port(kind=socket.SOCK_DGRAM)
    drones = hangar(1, "--call", f"127.0.0.1:{port}", kind="px4")
    assert asyncio.run(fly_with_mavsdk(port)) == []
    flown = heights(drones)
    assert max(flown) == pytest.approx(2.5, abs=0.3) and flown[-1] < 0.1


@pytest.mark.exhaustive
def test_mavproxy_lists_no_mission_and_flies_by_satellites(hangar: Any, interpreter: Any, tmp_path: Path) -> None:
    python, drones = interpreter("mavproxy"), hangar(1, kind="ardupilot")
    command = [str(python), str(python.with_name("mavproxy.py")), f"--master=udpout:{drones.addresses[0]}:14550"]
    pipe = subprocess.PIPE
    with subprocess.Popen(
        [*command, "--state-basedir", str(tmp_path)], stdin=pipe, stdout=pipe, stderr=subprocess.STDOUT, text=True
    ) as proxy:
        assert proxy.stdin is not None
        for seconds, line in [
            (8, "wp list"),
            (4, "mode GUIDED"),
            (2, "arm throttle"),
            (3, "takeoff 1.5"),
            (10, "mode LAND"),
        ]:
            time.sleep(seconds)
            print(line, file=proxy.stdin, flush=True)
        time.sleep(12.0)
        proxy.terminate()
        said = proxy.communicate(timeout=10)[0]
    assert "Requesting 0 waypoints" in said and "fence breach" not in said, said
    flown = heights(drones)
    assert max(flown) == pytest.approx(1.5, abs=0.2) and flown[-1] < 0.1, said
