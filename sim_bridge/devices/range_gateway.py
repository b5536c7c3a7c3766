"""An emulated gateway of ranges: measures every drone in turn against all anchors, and sends to its clients.

WIRE (docs/reference/ranges.md 2): a client that asks is sent ranges as long as it keeps sending.
"""

from collections.abc import Callable, Iterable
from contextlib import suppress
from time import time_ns

import msgspec
import numpy as np

from drivers.ranging.wire.ranges import LARGEST, Round, encode
from groundstation.arrays import Array
from groundstation.time_units import NS_PER_MS
from sim_bridge.fault_kinds import Fault, FaultKind, standing
from sim_bridge.listening import open_udp
from sim_bridge.ranges import Radios
from sim_bridge.site import SiteRanging, SiteTransponder

Address = tuple[str, int]
_TICK_S = 0.005
_DATAGRAMS_PER_TICK = 64
_FORGOTTEN_TICKS = 2000  # a client that is silent for 10 s is gone


class RangeGateway:
    """Socket and radios of one system; `sim_bridge.world.emulation.Emulator`.

    states: returns a row for each body, as `World.states` has them.
    """

    def __init__(
        self, name: str, place: Address, system: SiteRanging, bodies: Iterable[str], drones: Iterable[str],
        states: Callable[[], Array], radios: Radios, faults: Iterable[Fault] = (),
    ) -> None:  # fmt: skip
        self.silent = self.deaf = False
        self._name, self._system, self._states, self._faults = name, system, states, tuple(faults)
        self._rows = {body: row for row, body in enumerate(bodies)}
        self._drones = tuple(drones)
        self._socket = open_udp(f"emulated {name}", *place)
        self._radios = radios
        self._heard: dict[Address, int] = {}
        self._waiting: list[tuple[int, Round]] = []
        self._last_m: dict[str, dict[str, float]] = {}
        self._ticks = 0
        self._every = max(1, round(1.0 / (system.rate_hz * _TICK_S)))

    def fileno(self) -> int:
        """Return the descriptor of its port."""
        return self._socket.fileno()

    def receive(self) -> None:
        """Take the requests of clients."""
        for _ in range(_DATAGRAMS_PER_TICK):
            try:
                _, sender = self._socket.recvfrom(LARGEST)
            except OSError:
                return
            if not self.deaf:
                self._heard[sender] = self._ticks

    def send(self) -> None:
        """End a tick: measure the drones that are due, and send the rounds whose delay is over."""
        self._ticks += 1
        now_s = self._ticks * _TICK_S
        late = round(self._system.delay_ms / 1000 / _TICK_S)
        for index, drone in enumerate(self._drones):
            due = (self._ticks + index * self._every // len(self._drones)) % self._every == 0
            if due and (told := self._round(drone, now_s)):
                called = self._system.transponders.get(drone, SiteTransponder()).name or drone
                self._waiting.append((self._ticks + late, Round(called, told)))
        self._heard = {one: heard for one, heard in self._heard.items() if self._ticks - heard < _FORGOTTEN_TICKS}
        while self._waiting and self._waiting[0][0] <= self._ticks:
            _, waited = self._waiting.pop(0)
            datagram = encode(msgspec.structs.replace(waited, sent_ms=time_ns() / NS_PER_MS))
            dumb = self.silent or standing(self._faults, FaultKind.RANGES_SILENT, now_s, self._name)
            for client in () if dumb else self._heard:
                with suppress(OSError):
                    self._socket.sendto(datagram, client)

    def _round(self, drone: str, now_s: float) -> dict[str, float]:
        """Return a drone's distances to all anchors as they are sent [m, to the millimetre]."""
        if drone in self._last_m and standing(self._faults, FaultKind.RANGES_FROZEN, now_s, self._name):
            return self._last_m[drone]
        row = self._states()[self._rows[drone]]
        ranges_m = {} if np.isnan(row[0]) else self._radios.ranges_m(drone, row, now_s)
        detour = standing(self._faults, FaultKind.RANGES_LONG, now_s, drone)
        longer_m = detour.amount if detour else 0.0
        told = {anchor: round(m + longer_m, 3) for anchor, m in ranges_m.items() if m + longer_m > 0.0}
        self._last_m[drone] = told
        return told

    def close(self) -> None:
        """Close the port."""
        self._socket.close()
