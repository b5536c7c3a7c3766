"""The ranging driver and the emulated gateway on loopback, on a manual clock."""

import socket
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from stream_child import StreamChild

from drivers.ranging.driver import RangingDriver
from drivers.ranging.gateway import Gateway
from drivers.ranging.settings import RangingSection, parse_source
from groundstation.bus.memory_bus import MemoryBus, MemoryExchange
from groundstation.bus.topics import CAMERA_STATUS, RANGE
from sim_bridge.devices.range_gateway import RangeGateway
from sim_bridge.fault_kinds import Fault
from sim_bridge.ranges import Radios
from sim_bridge.site import SiteRanging

HOST, MS = "127.0.0.1", 1_000_000
ANCHORS = {
    "a": (-3.0, -3.0, 2.5),
    "b": (3.0, -3.0, 2.5),
    "c": (3.0, 3.0, 2.5),
    "d": (-3.0, 3.0, 2.5),
    "e": (0.0, 3.0, 0.2),
}
WIDE = {"x_m": (-3.0, 3.0), "y_m": (-3.0, 3.0), "z_m": (-0.1, 2.5)}
PLACES = {"drone_1": (0.5, 0.2, 1.5), "cart": (0.0, 0.0, 0.0), "drone_2": (-0.9, 0.1, 1.4)}


@dataclass
class Rig:
    """Emulated gateway, driver, and a subscriber; `run` advances both, the gateway on a manual clock."""

    gateway: RangeGateway
    driver: RangingDriver
    child: StreamChild
    heard: Any
    clock: SimpleNamespace

    def run(self, ticks: int, turn_every: int = 10) -> list[Any]:
        for tick in range(ticks):
            self.clock.ns += 5 * MS
            self.gateway.receive()
            self.gateway.send()
            if tick % turn_every == 0:
                self.driver.turn()
        self.driver.turn()
        return [one.message for one in self.heard.drain()]


@contextmanager
def opened(faults: Iterable[Fault], monkeypatch: pytest.MonkeyPatch) -> Iterator[Rig]:
    """Open gateway and driver; the gateway's own clock is an hour ahead."""
    clock = SimpleNamespace(ns=10**12)
    monkeypatch.setattr("groundstation.bus.clock.now_ns", lambda: clock.ns)
    monkeypatch.setattr("sim_bridge.devices.range_gateway.time_ns", lambda: clock.ns + 3600 * 1000 * MS)
    monkeypatch.setattr("drivers.ranging.driver._POLL_S", 0.001)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind((HOST, 0))
        place = (HOST, int(probe.getsockname()[1]))

    def states() -> np.ndarray:
        return np.array([[*at, 0, 0, 0, 0.0, 0.0, 0.3, 0, 0, 0, 0] for at in PLACES.values()])

    carried = {"drone_1": {"name": "0x1", "position_m": (0.0, 0.0, 0.1)}}
    system = SiteRanging.model_validate(
        {"anchors": ANCHORS, "volume_m": WIDE, "transponders": carried, "range_std_m": 2e-3, "outlier_share": 0.0}
    )
    drones, faults = ("drone_1", "drone_2"), tuple(faults)
    radios = Radios(system, errors=False, rng=np.random.default_rng(1), faults=faults)
    gateway = RangeGateway("uwb", place, system, PLACES, drones, states, radios, faults)
    section = RangingSection.model_validate(
        {
            "name": "uwb",
            "source": f"ranges://{HOST}:{place[1]}",
            "anchors": {name: at for name, at in ANCHORS.items() if name != "e"},
            "transponders": ({"entity": "drone_1", "name": "0x1"}, {"entity": "drone_2", "name": "drone_2"}),
            "volume_m": tuple(WIDE.values()),
            "silent_after_s": 0.3,
        }
    )
    exchange = MemoryExchange()
    child: Any = StreamChild(MemoryBus(exchange, "lab", "uwb"), "uwb", section.model_dump_json())
    heard = MemoryBus(exchange, "lab", "test").subscribe([RANGE, CAMERA_STATUS])
    client = Gateway(*parse_source(section.source))
    yield Rig(gateway, RangingDriver(child, section, client), child, heard, clock)
    client.close()
    gateway.close()
