"""Programs of others fly the emulated MAVLink vehicles as they come: connect with defaults, take off, land."""

import socket
from typing import Any

import pytest

pytestmark = [pytest.mark.slow, pytest.mark.interop, pytest.mark.timeout(150)]


def free_port() -> int:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as udp:
        udp.bind(("127.0.0.1", 0))
        return int(udp.getsockname()[1])


def heights(hangar: Any) -> list[float]:
    return [drone["position"][2] for states in hangar.stop() for drone in states.values()]


def test_dronekit_flies_an_ardupilot(hangar: Any, programs: Any) -> None:
    place = f"127.0.0.1:{free_port()}"
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
