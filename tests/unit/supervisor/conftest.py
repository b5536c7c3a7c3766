"""A supervisor of real child processes that leaves none behind."""

import json
import os
import signal
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from free_port import free_port

from groundstation.flight.composition import router_section
from groundstation.settings.behaviour import Bus
from groundstation.supervisor.process_spec import ProcessSpec, StopOrder
from groundstation.supervisor.run import Run
from groundstation.supervisor.supervisor import Supervisor
from groundstation.supervisor.terminal import Terminal

HERE = Path(__file__).parent
sys.path.insert(0, str(HERE))  # for the helper modules of this folder


@pytest.fixture
def make(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Callable[..., Supervisor]]:
    runtime = tmp_path / "runtime"
    runtime.mkdir()
    monkeypatch.setenv("PYTHONPATH", str(HERE))
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(runtime))
    taken_over = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGCHLD)
    handlers = {number: signal.getsignal(number) for number in taken_over}
    made: list[Supervisor] = []
    sink = os.open(tmp_path / "terminal", os.O_WRONLY | os.O_CREAT)

    def build(*specs: ProcessSpec, guarded: bool = False) -> Supervisor:
        endpoint = f"{'tls' if guarded else 'tcp'}/127.0.0.1:{free_port()}"
        router = ProcessSpec(
            "router",
            "router",
            entry="groundstation.runtime.router:run",
            section=router_section(endpoint, "lab", specs, Bus()) if guarded else json.dumps({"endpoint": endpoint}),
            stop_order=StopOrder.CONNECTS,
            on_bus=False,
        )
        run = Run("lab", "lab", endpoint, tmp_path / "run", ("drone_1",))
        made.append(Supervisor(run, (router, *specs), Terminal(sink)))
        return made[-1]

    yield build
    for supervisor in made:
        supervisor.interrupts.hurry = True
        supervisor.close()
        assert all(not process.running for process in supervisor.processes)
    for number, handler in handlers.items():
        signal.signal(number, handler)
    os.close(sink)
