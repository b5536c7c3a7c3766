"""A run served by another host: launch specification, end, refusal of a wrong version; without a network."""

import logging
import signal
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import cast

import pytest

from groundstation.bus import clock
from groundstation.bus.memory_bus import MemoryBus, MemoryExchange
from groundstation.bus.messages import HostOrder, Lifecycle, Supervision
from groundstation.bus.roles import Identity
from groundstation.errors import GroundStationError
from groundstation.flight import hosting
from groundstation.runtime.liaison import VERSION, Liaison, LiaisonSection
from groundstation.settings.load import load_field
from groundstation.supervisor import host_link, supervisor
from groundstation.supervisor.site import Admission
from groundstation.supervisor.terminal import Terminal

LAB = Path(__file__).parents[2] / "fixtures" / "field" / "lab.yaml"
HOST = "pc_2"
SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)


class RunElsewhere:
    """The liaison of a run, on a thread; announces the end when the host is ready."""

    def __init__(self, exchange: MemoryExchange, version: str) -> None:
        section = LiaisonSection(HOST, version, load_field(LAB, ()).model_dump_json())
        self.liaison = Liaison(MemoryBus(exchange, "lab", f"liaison_{HOST}", "run-7"), section)
        self.states: list[Lifecycle] = []
        self.details: list[str] = []
        self.over = threading.Event()
        self.thread = threading.Thread(target=self._speak)
        self.thread.start()

    def _speak(self) -> None:
        supervision = Supervision.WATCHES
        while not self.over.wait(0.002):
            self.liaison.turn(clock.own_ns(), supervision)
            state, detail = self.liaison.state(clock.own_ns())
            self.states.append(state)
            self.details.append(detail)
            if state is Lifecycle.READY:
                supervision = Supervision.ENDS


@pytest.fixture
def make(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> Iterator[Callable[[str], tuple[hosting.Hosting, RunElsewhere]]]:
    exchange, runs = MemoryExchange(), list[RunElsewhere]()
    handlers = {number: signal.getsignal(number) for number in SIGNALS}
    root = logging.getLogger()
    kept, level = list(root.handlers), root.level
    monkeypatch.setattr(logging, "raiseExceptions", logging.raiseExceptions)  # it is switched off in flight

    def open_bus(
        endpoint: str, site: str, source: str, *_: object, identity: Identity | None = None, **_more: object
    ) -> MemoryBus:
        return MemoryBus(exchange, site, source, identity.run if identity else "")

    for module in (hosting, supervisor):
        monkeypatch.setattr(module, "open_bus", open_bus)
    monkeypatch.setattr(hosting, "device_rows", lambda field, host: [])
    monkeypatch.setattr(hosting, "_TURN_S", 0.001)
    monkeypatch.setattr(host_link, "_PERIOD_NS", 1_000_000)

    def build(version: str) -> tuple[hosting.Hosting, RunElsewhere]:
        admission = Admission("lab", HOST, "tls/10.77.0.1:4717", "", "", "")
        runs.append(RunElsewhere(exchange, version))
        return hosting.Hosting(admission, Identity("keys", "host-pc_2", ""), tmp_path, Terminal()), runs[-1]

    yield build
    for run in runs:
        run.over.set()
        run.thread.join()
    clock.follow_none()
    signal.set_wakeup_fd(-1)
    for number, former in handlers.items():
        signal.signal(number, former)
    for handler in set(root.handlers) - set(kept):
        root.removeHandler(handler)
        handler.close()
    root.setLevel(level)


def test_a_host_serves_the_run_that_it_is_told_of_until_that_ends(
    make: Callable[[str], tuple[hosting.Hosting, RunElsewhere]], tmp_path: Path
) -> None:
    served, run = make(VERSION)
    order = served.wait()
    assert isinstance(order, HostOrder) and order.run == "run-7"
    assert served.serve(order) is False, "nobody interrupted it here"
    assert Lifecycle.READY in run.states and run.states[-1] is not Lifecycle.READY
    assert not run.liaison.serving, "it said good-bye"
    assert (tmp_path / "run-7" / "log" / "supervisor.log").exists()


def test_a_run_that_is_gone_before_its_devices_start_ends_the_run_and_not_the_waiting_for_the_next(
    make: Callable[[str], tuple[hosting.Hosting, RunElsewhere]], monkeypatch: pytest.MonkeyPatch
) -> None:
    served, _ = make(VERSION)
    order = served.wait()

    def gone(*_: object, **__: object) -> None:
        raise GroundStationError("no router answers at tls/10.77.0.1:4717")

    monkeypatch.setattr(supervisor, "open_bus", gone)
    said: list[str] = []
    monkeypatch.setattr(served._terminal, "say", said.append)
    assert served.serve(order) is False, "nobody interrupted it here"
    assert said[-1] == "run run-7: no router answers at tls/10.77.0.1:4717; drones of this host land"


def test_after_the_runs_host_slept_the_drones_of_this_host_land_and_the_run_is_told_why(
    make: Callable[[str], tuple[hosting.Hosting, RunElsewhere]], monkeypatch: pytest.MonkeyPatch
) -> None:
    served, run = make(VERSION)
    stop = supervisor.Supervisor.stop

    def land(self: supervisor.Supervisor) -> None:
        for _ in range(10):
            self.step(0.01)
        stop(self)

    monkeypatch.setattr(supervisor.Supervisor, "stop", land)
    order, stood = served.wait(), "the clock of the run's host stood still for 3.0 s: it slept or was paused"
    served._link.stood = stood
    said: list[str] = []
    monkeypatch.setattr(served._terminal, "say", said.append)
    assert served.serve(order) is False
    assert said[-1] == f"run run-7: {stood}; drones of this host land"
    assert f"pc_2 lands its drones: {stood}" in run.details


def test_a_stop_that_comes_while_the_drones_land_is_not_lost(
    make: Callable[[str], tuple[hosting.Hosting, RunElsewhere]], monkeypatch: pytest.MonkeyPatch
) -> None:
    """It waited for the next run."""
    served, _ = make(VERSION)
    order, close = served.wait(), supervisor.Supervisor.close

    def stopped_meanwhile(self: supervisor.Supervisor) -> None:
        self.interrupts.stop_requested = True
        close(self)

    monkeypatch.setattr(supervisor.Supervisor, "close", stopped_meanwhile)
    assert served.serve(order) is True


def test_a_host_says_farewell_before_it_leaves_the_bus(
    make: Callable[[str], tuple[hosting.Hosting, RunElsewhere]], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Leaving took longer than a silence, and the run reported that the link was down."""
    served, run = make(VERSION)
    order, close, missed = served.wait(), supervisor.Supervisor.close, list[bool]()

    def close_late(self: supervisor.Supervisor) -> None:
        time.sleep(0.6)
        missed.append(run.liaison.serving)
        close(self)

    monkeypatch.setattr(supervisor.Supervisor, "close", close_late)
    served.serve(order)
    assert missed == [False]


def test_another_version_is_not_served_and_the_run_says_why(
    make: Callable[[str], tuple[hosting.Hosting, RunElsewhere]], monkeypatch: pytest.MonkeyPatch
) -> None:
    served, run = make("0.0.1")

    def stop_when_told(_: float) -> None:
        if run.details and "the run 0.0.1" in run.details[-1]:
            raise KeyboardInterrupt
        run.over.wait(0.001)

    monkeypatch.setattr(time, "sleep", stop_when_told)
    with pytest.raises(KeyboardInterrupt):
        served.wait()
    assert not run.liaison.serving and Lifecycle.READY not in run.states


class NoticeBoard:
    """A terminal that records its texts, and ends the wait after enough of them."""

    def __init__(self, enough: int) -> None:
        self.said: list[str] = []
        self._enough = enough

    def say(self, text: str) -> None:
        self.said.append(text)
        if len(self.said) >= self._enough:
            raise KeyboardInterrupt


def waiting(board: NoticeBoard, tmp_path: Path) -> None:
    admission = Admission("lab", HOST, "tls/10.77.0.1:4717", "", "", "")
    with pytest.raises(KeyboardInterrupt):
        hosting.Hosting(admission, Identity("keys", "host-pc_2", ""), tmp_path, cast(Terminal, board)).wait()


def test_why_a_run_lets_it_not_in_is_told_once_for_each_reason(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    reasons = iter(["", "made anew", "made anew", "", "other addresses"])

    def closed(*_: object, **__: object) -> None:
        raise GroundStationError("no router answers")

    monkeypatch.setattr(hosting, "open_bus", closed)
    monkeypatch.setattr(hosting, "why_closed", lambda *_: next(reasons))
    board = NoticeBoard(3)
    waiting(board, tmp_path)
    assert board.said == [f"{HOST} waits for a run of lab at tls/10.77.0.1:4717", "made anew", "other addresses"]


def test_a_host_that_gets_nothing_to_do_says_so_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    bus = MemoryBus(MemoryExchange(), "lab", HOST, "")
    monkeypatch.setattr(hosting, "open_bus", lambda *_, **__: bus)
    monkeypatch.setattr(hosting, "_IDLE_S", 0.0)
    board = NoticeBoard(2)
    waiting(board, tmp_path)
    assert "no device of the run has host: pc_2" in board.said[-1]
