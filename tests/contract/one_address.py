"""Two sets of vehicles with the same addresses, each behind its own adapter; prints the datagrams that each received.

Run in a network namespace of its own, as root there: `unshare --user --map-root-user --net python one_address.py`. The
vehicles of each adapter live in a further namespace at its other end; both ends have the same addresses.
"""

import ctypes
import json
import os
import socket
import subprocess
import threading
import time
from collections.abc import Iterator
from contextlib import closing, contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from drivers.ardrone.driver import ArDrone
from drivers.ardrone.probe import probe
from drivers.ardrone.queries import read_version
from drivers.ardrone.settings import ArDroneDriverSettings
from drivers.camera.sources.opening import open_source
from drivers.mavlink.links.udp import UdpLink
from drivers.mavlink.settings import LinkSettings
from drivers.mavlink.wire.telemetry import Heartbeat
from drivers.tello.driver import Tello
from drivers.tello.settings import TelloDriverSettings
from drivers.watchdog_types import Action, DriverMode, WatchdogDecision
from groundstation.bus.memory_bus import MemoryBus, MemoryExchange
from groundstation.supervisor.failsafe_sender import FailsafeSender
from groundstation.supervisor.process_spec import FailsafeDatagrams
from groundstation.vehicles import kind_named
from sim_bridge.conformance.subject import subject_of
from sim_bridge.devices.ardrone_firmware import FIRMWARES
from sim_bridge.devices.tello import TelloBody, TelloEmulator
from sim_bridge.scenario import Scenario
from sim_bridge.site import SiteDrone
from sim_bridge.standalone import Hangar
from sim_bridge.world.ardrone import Quadrotor
from sim_bridge.world.world import TICK_NS

_NEWNET = 0x40000000
_ARDRONE, _TELLO = "192.168.1.1", "192.168.10.1"
_ADAPTERS = {"w1": "ar2-2.3", "w2": "ar2-2.4.8"}
_PAD = {"pad_m": (0.0, 0.0), "marker": {"code": 1, "position_m": (0.0, 0.0, 0.08)}}
_libc = ctypes.CDLL(None, use_errno=True)


def _checked(result: int) -> None:
    if result:
        raise OSError(ctypes.get_errno(), os.strerror(ctypes.get_errno()))


class Beyond:
    """The other end of an adapter: an AR.Drone, a PX4 and a Tello, and their clock."""

    def __init__(self, adapter: str, index: int) -> None:
        here = os.open("/proc/self/ns/net", os.O_RDONLY)
        _checked(_libc.unshare(_NEWNET))
        self._here, self._there = here, os.open("/proc/self/ns/net", os.O_RDONLY)
        _checked(_libc.setns(here, 0))
        there = f"/proc/{os.getpid()}/fd/{self._there}"
        _ip(f"link add {adapter} type veth peer name far netns {there}")
        self._connect(adapter, ".2")
        with self.entered():
            self._connect("far", ".1")
            # The position in the list is the system id of a PX4.
            names = [_ARDRONE, f"px4@{_ARDRONE}"]
            self.hangar = Hangar(names[:: 1 if index else -1], FIRMWARES[_ADAPTERS[adapter]])
            body = TelloBody(SiteDrone.model_validate({"kind": "tello", **_PAD}), Scenario(), 0.005, _rng(index))
            self.tello, self.tello_body = TelloEmulator("tello", _TELLO, body), body
        self.ardrone = self.hangar.world.of(Quadrotor)[_ARDRONE]
        self.ardrone.battery = self.tello_body.battery = 0.9 - 0.4 * index

    @staticmethod
    def _connect(name: str, last: str) -> None:
        _ip("link set lo up")
        for network in (_ARDRONE, _TELLO):
            _ip(f"addr add {network.rpartition('.')[0]}{last}/24 dev {name}")
        _ip(f"link set {name} up")

    @contextmanager
    def entered(self) -> Iterator[None]:
        """Create sockets and start processes in the namespace at the other end."""
        _checked(_libc.setns(self._there, 0))
        try:
            yield
        finally:
            _checked(_libc.setns(self._here, 0))

    def tick(self) -> None:
        with self.entered():  # they open ports in flight, too
            self.hangar.tick(time.monotonic_ns())
        self.tello.receive()
        self.tello_body.step((0.0, 0.0, 0.0))
        self.tello_body.sense()
        self.tello.send()


def _rng(seed: int) -> np.random.Generator:
    return np.random.default_rng(seed)


def _ip(order: str) -> None:
    subprocess.run(["ip", *order.split()], check=True)


def _turn(all_beyond: list[Beyond], stop: threading.Event) -> None:
    due_ns = time.monotonic_ns()
    while not stop.is_set():
        for beyond in all_beyond:
            beyond.tick()
        due_ns = max(due_ns + TICK_NS, time.monotonic_ns() - 20 * TICK_NS)
        time.sleep(max(0.0, (due_ns - time.monotonic_ns()) / 1e9))


def _bus(name: str) -> MemoryBus:
    return MemoryBus(MemoryExchange(), "lab", name)


def _until(true: Any, seconds: float, meanwhile: Any = lambda: None) -> bool:
    deadline_s = time.monotonic() + seconds
    while not true() and time.monotonic() < deadline_s:
        meanwhile()
        time.sleep(0.03)
    return bool(true())


def _decision(action: Action) -> WatchdogDecision:
    return WatchdogDecision(DriverMode.HOVER, action)


def ardrones(beyond: dict[str, Beyond]) -> dict[str, Any]:
    """Two drivers: one drone takes off, the other stays; then the guardian lands it through its adapter."""
    made = {
        name: ArDrone(ArDroneDriverSettings(name=name, address=_ARDRONE, interface=name), _bus(name)) for name in beyond
    }
    actions = dict.fromkeys(made, Action.WAIT)

    def send() -> None:
        for name, drone in made.items():
            drone.apply(time.monotonic_ns(), _decision(actions[name]))

    def views() -> dict[str, Any]:
        return {name: drone.view(time.monotonic_ns()) for name, drone in made.items()}

    ready = _until(lambda: all(view.configured for view in views().values()), 15.0, send)
    heard = {name: view.battery for name, view in views().items()}
    actions["w2"] = Action.TAKE_OFF
    _until(lambda: not beyond["w2"].ardrone.airframe.on_ground, 12.0, send)
    aloft = {name: not one.ardrone.airframe.on_ground for name, one in beyond.items()}
    shown = {name: drone.address for name, drone in made.items()}
    for drone in made.values():
        drone.close()
    words = kind_named("ardrone").stop([subject_of("ardrone").order()])
    with closing(FailsafeSender()) as guardian:
        spoken = FailsafeDatagrams(_ARDRONE, words.port, words.hover, words.land, 0.2, interface="w2")
        guardian.begin("w2", spoken, time.monotonic_ns())
        landed = _until(
            lambda: beyond["w2"].ardrone.airframe.on_ground, 12.0, lambda: guardian.send_due(time.monotonic_ns())
        )
    return {"ready": ready, "heard": heard, "aloft": aloft, "landed": landed, "shown": shown}


def tellos(beyond: dict[str, Beyond]) -> dict[str, Any]:
    """Two drivers with one port for the state of both."""
    made = {
        name: Tello(TelloDriverSettings(name=name, address=_TELLO, interface=name, pad_m=(0.0, 0.0)), _bus(name))
        for name in beyond
    }

    def views() -> dict[str, Any]:
        return {name: one.view(time.monotonic_ns()) for name, one in made.items()}

    def send() -> None:
        for one in made.values():
            one.apply(time.monotonic_ns(), _decision(Action.WAIT))

    ready = _until(lambda: all(view.fresh and view.configured for view in views().values()), 5.0, send)
    heard = {name: view.battery for name, view in views().items()}
    for one in made.values():
        one.close()
    return {"ready": ready, "heard": heard}


def systems(name: str) -> list[int]:
    """Return the MAVLink systems behind an adapter."""
    link, found = UdpLink(LinkSettings(target=f"udpout:{_ARDRONE}%{name}:14550")), set[int]()
    with closing(link):

        def look() -> None:
            link.send(0, Heartbeat(6, 8, 0, 0, 4))
            found.update(heard.frame.system for heard in link.receive())

        _until(lambda: found, 5.0, look)
    return sorted(found)


def videos(beyond: dict[str, Beyond]) -> dict[str, bool]:
    """Return the drone whose video port a source connects to, by the adapter that it names."""
    servers, reached = {}, {}
    for name, one in beyond.items():
        with one.entered():
            servers[name] = socket.create_server((_ARDRONE, 5555))
            servers[name].settimeout(3.0)
    for name, server in servers.items():
        source = open_source(f"ardrone://{_ARDRONE}%{name}")
        try:
            server.accept()[0].close()
            reached[name] = True
        except TimeoutError:
            reached[name] = False
        finally:
            source.close()
    for server in servers.values():
        server.close()
    return reached


def main() -> None:
    """Print one line of JSON."""
    beyond = {name: Beyond(name, index) for index, name in enumerate(_ADAPTERS)}
    # Loose: a strict filter drops packets that arrive through another adapter than the route back.
    Path("/proc/sys/net/ipv4/conf/all/rp_filter").write_text("2")
    stop = threading.Event()
    clock = threading.Thread(target=_turn, args=(list(beyond.values()), stop))
    clock.start()
    try:
        told = {
            "versions": {name: read_version(f"{_ARDRONE}%{name}", 5551, 3.0) for name in beyond},
            "by_route": read_version(_ARDRONE, 5551, 3.0),
            "probed": probe(f"{_ARDRONE}%w2").identity.firmware,
            "systems": {name: systems(name) for name in beyond},
            "videos": videos(beyond),
            "tellos": tellos(beyond),
            "ardrones": ardrones(beyond),
        }
    finally:
        stop.set()
        clock.join()
    print(json.dumps(told))


if __name__ == "__main__":
    main()
