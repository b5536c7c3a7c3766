"""LAND ALL in the page, and what reaches the emulated drones on the wire."""

import json
import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any

import pytest
from seen_page import Seen, eventually
from serve_fake import field_json

from groundstation.bus import topics as t
from groundstation.bus.messages import TruthState
from groundstation.bus.zenoh_bus import ZenohBus, open_bus
from groundstation.supervisor import runtime_file

pytestmark = [pytest.mark.browser, pytest.mark.sitl, pytest.mark.slow, pytest.mark.timeout(600)]

_FLY, _LAND = 290718208, 290717696
_REF = re.compile(rb"AT\*REF=\d+,(\d+)")
_DRONES = {"drone_1", "drone_2"}


class Witness:
    """Hears what drivers send to their drones, and where the bodies really are."""

    def __init__(self, bus: ZenohBus) -> None:
        self.bus = bus
        self._sent = bus.subscribe([t.RAW_TX], capacity=20_000)
        self._truth = bus.subscribe([t.TRUTH], newest=True)
        self.references: dict[str, int] = {}
        self.grounded: dict[str, bool] = {}

    def look(self) -> "Witness":
        for received in self._sent.drain():
            for value in _REF.findall(received.payload):
                self.references[received.header.entity] = int(value)
        for received in self._truth.drain():
            if isinstance(received.message, TruthState):
                self.grounded[received.header.entity] = received.message.on_ground
        return self


@pytest.fixture(scope="module")
def kernels() -> None:
    """Compile the tracker's kernels before the run: on a busy machine that takes longer than a run waits for it."""
    script = (
        "import json, sys; from groundstation.process import numba_cache; numba_cache.activate();"
        "from groundstation.runtime.warm_up import warm_up; warm_up(json.load(sys.stdin))"
    )
    field = json.dumps(field_json(8765)).encode()
    subprocess.run([sys.executable, "-c", script], input=field, timeout=280, check=True)


@pytest.fixture
def flight(kernels: None, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[runtime_file.RuntimeRecord]:
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    arguments = ["sitl", "lab", "--headless", "--duration", "120", "--report", str(tmp_path)]
    process = subprocess.Popen([sys.executable, "-m", "groundstation.cli.main", *arguments], stdout=subprocess.DEVNULL)
    try:
        yield eventually(lambda: next(iter(runtime_file.live_records()), None), 60.0, "a run")
    finally:
        process.send_signal(signal.SIGINT)
        with suppress(subprocess.TimeoutExpired):
            process.wait(60)
        process.kill()
        process.wait(10)


@pytest.fixture
def served(flight: runtime_file.RuntimeRecord, free_port: int) -> Iterator[str]:
    command = [sys.executable, "-m", "groundstation.cli.main", "console", "--port", str(free_port)]
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL, env=dict(os.environ))
    yield f"http://127.0.0.1:{free_port}/"
    process.terminate()
    process.wait(10)


def test_land_all_reaches_the_emulated_drones(flight: runtime_file.RuntimeRecord, served: str, open_page: Any) -> None:
    bus = open_bus(flight.endpoint, flight.site, "witness")
    try:
        witness = Witness(bus)
        page: Seen = open_page(served)
        eventually(lambda: not flight.supervisor.alive or _aloft(witness.look()), 150.0, "both drones fly")
        assert flight.supervisor.alive, "the run has ended before its time"
        page.wait(lambda s: {"drone_1", "drone_2"} <= set(s["ellipses"]), 60.0)
        page.page.wait_for_timeout(1500)
        page.shot("sitl_flying")
        page.there("land-all").click()
        eventually(lambda: _ordered_down(witness.look()), 5.0, "LAND on the wire")
        page.wait(lambda s: any(o["verb"] == "LAND" and o["state"] == "confirmed" for o in s["orders"]), 30.0)
        eventually(lambda: all(witness.look().grounded[name] for name in _DRONES), 20.0, "on the ground")
        page.shot("sitl_landed")
        assert not page.troubles, page.troubles
    finally:
        bus.close()
        time.sleep(0.1)


def _aloft(witness: Witness) -> bool:
    flying = {name for name, value in witness.references.items() if value == _FLY}
    return flying >= _DRONES and not any(witness.grounded.get(name, True) for name in _DRONES)


def _ordered_down(witness: Witness) -> bool:
    return all(witness.references[name] == _LAND for name in _DRONES)
