"""Time from a click on a stop to the first datagram that obeys it, in flight."""

import math
import os
import re
import time
from collections.abc import Callable
from typing import Any

import pytest
from seen_page import Seen, eventually

from drivers.datagrams import unpack
from groundstation.bus.messages import Command, Verb
from groundstation.bus.roles import Role
from groundstation.bus.topics import COMMAND, RAW_TX
from groundstation.bus.zenoh_bus import ZenohBus
from groundstation.supervisor import runtime_file
from groundstation.supervisor.joining import join

pytestmark = [pytest.mark.browser, pytest.mark.sitl, pytest.mark.slow, pytest.mark.exhaustive, pytest.mark.timeout(600)]

_CLICKS = 25
_MOTION = re.compile(rb"AT\*PCMD(?:_MAG)?=-?\d+,(\d+)")
# The browser's own time of each click, since the epoch [ms].
_LISTEN = """() => { window.__clicked = []; document.addEventListener("click", (event) =>
    window.__clicked.push(performance.timeOrigin + event.timeStamp), {capture: true}); }"""


class Datagrams:
    """Times of datagrams with motion and with hover to each drone, by the driver's stamp [s since boot]."""

    def __init__(self, bus: ZenohBus) -> None:
        self._sent = bus.subscribe([RAW_TX], capacity=20_000)
        self._ordered = bus.subscribe([COMMAND])
        self.holds: dict[str, float] = {}
        self.heard: dict[str, list[tuple[float, bool]]] = {"drone_1": [], "drone_2": []}

    def look(self) -> "Datagrams":
        for received in self._sent.drain():
            for stamp_ns, datagram in unpack(received.payload):
                if motion := _MOTION.search(datagram):
                    self.heard[received.header.entity].append((stamp_ns * 1e-9, bool(int(motion[1]) & 1)))
        for received in self._ordered.drain():
            if isinstance(order := received.message, Command) and order.verb is Verb.HOLD:
                self.holds[order.id] = order.header.stamp_ns * 1e-9
        return self

    def all_move(self) -> bool:
        return all(heard and heard[-1][1] for heard in self.heard.values())

    def all_hover(self) -> bool:
        return not any(heard and heard[-1][1] for heard in self.heard.values())

    def given_s(self, since_s: float) -> float:
        """Return the time from the click to the console's command [s]."""
        return next((at - since_s for at in self.look().holds.values() if at >= since_s), math.nan)

    def obeyed_s(self, drone: str, since_s: float) -> float | None:
        return next((at - since_s for at, moves in self.heard[drone] if at >= since_s and not moves), None)


def _words(what: str, delays_s: list[float]) -> str:
    ordered = sorted(1e3 * delay for delay in delays_s)
    return f"{what}: median {ordered[len(ordered) // 2]:.0f} ms, worst of {len(ordered)} {ordered[-1]:.0f} ms"


def test_a_click_on_hold_is_obeyed_within_50_ms(
    live: runtime_file.RuntimeRecord, served: str, open_page: Any, record_property: Callable[[str, object], None]
) -> None:
    bus = join(live, "view", Role.VIEW)
    try:
        wire = Datagrams(bus)
        page: Seen = open_page(served)
        page.page.evaluate(_LISTEN)
        delays, given = list[float](), list[float]()
        eventually(lambda: wire.look().all_move(), 150.0, "both drones are moved")
        for _ in range(_CLICKS):
            eventually(lambda: wire.look().all_move(), 20.0, "both drones are moved again")
            page.there("hold").click()
            eventually(lambda: wire.look().all_hover(), 5.0, "both drones hover")
            clicked_s = page.page.evaluate("() => window.__clicked.at(-1)") / 1e3 - time.time() + time.monotonic()
            delays += [wire.obeyed_s(drone, clicked_s) or 0.0 for drone in wire.heard]
            given.append(wire.given_s(clicked_s))
            page.there("resume").click()
        assert live.supervisor.alive, "the run has ended before its time"
    finally:
        bus.close()
    figures = f"{_words('datagram', delays)}; {_words('order given', given)}; load {os.getloadavg()[0]:.1f}"
    record_property("click to datagram", figures)
    print(figures)
    assert min(delays) > 0.0 and max(delays) <= 0.05, figures
