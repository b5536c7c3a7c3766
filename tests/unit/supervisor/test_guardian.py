"""The guardian with real processes: the sender to a fake drone when driver and supervisor die, freeze and end."""

import json
import os
import pickle
import signal
import socket
import subprocess
import sys
import textwrap
import time
from collections.abc import Callable, Iterator
from contextlib import closing, suppress
from dataclasses import replace
from itertools import pairwise, product
from pathlib import Path

import msgspec
import pytest
from dummy_table import spec, until

from groundstation.supervisor.failsafe_sender import FailsafeSender
from groundstation.supervisor.guard_order import GuardOrder, guarded
from groundstation.supervisor.managed_process import ManagedProcess
from groundstation.supervisor.process_spec import FailsafeDatagrams, ProcessSpec
from groundstation.supervisor.run import Run
from groundstation.supervisor.runtime_file import start_time
from groundstation.supervisor.supervisor import Supervisor
from groundstation.supervisor.terminal import Terminal

HERE = Path(__file__).parent
LAND_AFTER_S, LANDING_S = 1.0, 0.4


class FakeDrone:
    """A UDP port on loopback that records (time [s], datagram)."""

    def __init__(self) -> None:
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.bind(("127.0.0.1", 0))
        self.port = int(self._socket.getsockname()[1])

    def listen(self, for_s: float) -> list[tuple[float, bytes]]:
        heard, end = [], time.monotonic() + for_s
        while (left := end - time.monotonic()) > 0:
            self._socket.settimeout(left)
            try:
                heard.append((self._socket.recv(100), time.monotonic()))
            except TimeoutError:
                break
        return [(at, data) for data, at in heard]

    def close(self) -> None:
        self._socket.close()


@pytest.fixture
def drone() -> Iterator[FakeDrone]:
    made = FakeDrone()
    yield made
    made.close()


def table(drone: FakeDrone, entry: str, **options: object) -> tuple[ProcessSpec, ...]:
    """Return a guardian with a short landing time, and a driver of a dummy's kind."""
    words = FailsafeDatagrams("127.0.0.1", drone.port, b"hover", b"land", LAND_AFTER_S)
    section = json.dumps({"port": drone.port})
    guardian, driver = guarded(
        (spec("drone_1", entry, section=section, failsafe_datagrams=words, on_bus=False, **options),)
    )
    order = msgspec.json.decode(guardian.section, type=GuardOrder)
    brief = msgspec.json.encode(GuardOrder(order.posts, LANDING_S)).decode()
    return replace(guardian, section=brief), driver


@pytest.fixture
def start(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Callable[..., Supervisor]]:
    monkeypatch.setenv("PYTHONPATH", str(HERE))
    handlers = {number: signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)}
    made: list[Supervisor] = []
    sink = os.open(tmp_path / "terminal", os.O_WRONLY | os.O_CREAT)

    def begin(rows: tuple[ProcessSpec, ...]) -> Supervisor:
        supervisor = Supervisor(Run("lab", "lab", "", tmp_path / "run", ()), rows, Terminal(sink))
        made.append(supervisor)
        supervisor.prepare()
        for process in supervisor.processes:
            supervisor.launch(process)
        until(supervisor, lambda: all(process.is_up for process in supervisor.processes))
        return supervisor

    yield begin
    for supervisor in made:
        supervisor.close()
    for number, handler in handlers.items():
        signal.signal(number, handler)
    os.close(sink)


def said_on(tmp_path: Path) -> str:
    return (tmp_path / "terminal").read_text()


SCRIPT = """
    import json, pickle, sys
    from pathlib import Path
    from groundstation.supervisor.run import Run
    from groundstation.supervisor.supervisor import Supervisor
    from groundstation.supervisor.terminal import Terminal
    folder, rows = Path(sys.argv[1]), pickle.loads(bytes.fromhex(sys.argv[2]))
    supervisor = Supervisor(Run("lab", "lab", "", folder, ()), rows, Terminal())
    supervisor.prepare()
    for process in supervisor.processes:
        supervisor.launch(process)
    while not all(process.is_up for process in supervisor.processes):
        supervisor.step()
    print(json.dumps({p.spec.name: p.pid for p in supervisor.processes}), flush=True)
    while True:
        supervisor.step()
"""


class SupervisedRun:
    """A supervisor in its own process; `pids` are those of its children by name."""

    def __init__(self, folder: Path, rows: tuple[ProcessSpec, ...]) -> None:
        command = [sys.executable, "-c", textwrap.dedent(SCRIPT), str(folder), pickle.dumps(rows).hex()]
        self.process = subprocess.Popen(command, stdout=subprocess.PIPE)
        assert self.process.stdout is not None
        self.pids: dict[str, int] = json.loads(self.process.stdout.readline())

    def alive(self, name: str) -> bool:
        return start_time(self.pids[name]) is not None

    def until_gone(self, *names: str, limit_s: float = 5.0) -> None:
        deadline = time.monotonic() + limit_s
        while any(map(self.alive, names)):
            assert time.monotonic() < deadline, f"orphans among {names}"
            time.sleep(0.02)

    def close(self) -> None:
        tasks = Path(f"/proc/{self.process.pid}/task/{self.process.pid}/children")
        with suppress(OSError):  # the restarted ones
            self.pids |= {f"child {pid}": int(pid) for pid in tasks.read_text().split()}
        self.process.kill()
        self.process.communicate()
        for name, pid in self.pids.items():
            if self.alive(name):
                os.kill(pid, signal.SIGKILL)


@pytest.fixture
def run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, drone: FakeDrone) -> Iterator[SupervisedRun]:
    monkeypatch.setenv("PYTHONPATH", f"{HERE}:{os.environ.get('PYTHONPATH', '')}")
    made = SupervisedRun(tmp_path / "run", table(drone, "flying"))
    yield made
    made.close()


FATES = list(product((signal.SIGKILL, signal.SIGSTOP), repeat=2))


@pytest.mark.parametrize(("above", "below"), FATES, ids=[f"{a.name}-{b.name}" for a, b in FATES])
def test_hovers_and_lands_a_drone_without_supervisor_and_driver(
    run: SupervisedRun, drone: FakeDrone, above: signal.Signals, below: signal.Signals
) -> None:
    assert {data for _, data in drone.listen(0.3)} == {b"fly"}
    broken = time.monotonic()
    os.kill(run.pids["drone_1"], below)
    run.process.send_signal(above)
    heard = [(at - broken, data) for at, data in drone.listen(2.0)]
    stops = [at for at, data in heard if data != b"fly"]
    lands = [at for at, data in heard if data == b"land"]
    assert stops[0] <= 0.5 and lands[0] <= LAND_AFTER_S + 0.5
    assert all(data != b"fly" for at, data in heard if at > stops[0]), "hover, then land, and nothing else"
    assert all(data == b"land" for at, data in heard if at > lands[0])
    times = [0.0, *(at for at, _ in heard), 1.4]
    assert max(b - a for a, b in pairwise(times)) <= 0.5, "somebody always speaks"
    run.until_gone("drone_1")
    if above is signal.SIGSTOP:
        assert run.alive("guardian"), "the supervisor may wake up"
        run.process.kill()
    run.until_gone("guardian")
    assert not Path(f"/dev/shm/skein-lab-{run.process.pid}").exists()


def test_is_silent_while_the_driver_lives(run: SupervisedRun, drone: FakeDrone) -> None:
    run.process.kill()
    heard = drone.listen(1.5)
    assert len(heard) > 30 and {data for _, data in heard} == {b"fly"}
    assert run.alive("guardian")
    os.kill(run.pids["drone_1"], signal.SIGTERM)  # it ends as one that has landed
    run.until_gone("drone_1", "guardian")
    assert {data for _, data in drone.listen(0.2)} <= {b"fly"}


def test_a_supervisor_that_wakes_up_goes_on_with_land(run: SupervisedRun, drone: FakeDrone) -> None:
    os.kill(run.pids["drone_1"], signal.SIGKILL)
    run.process.send_signal(signal.SIGSTOP)
    said = [data for _, data in drone.listen(1.6)]
    assert said[-1] == b"land"
    run.process.send_signal(signal.SIGCONT)
    assert b"hover" not in {data for _, data in drone.listen(0.3)}
    said = [data for _, data in drone.listen(3.0)]
    assert said[-1] == b"fly", "the driver was started again"


def test_is_started_again_and_ends_with_the_run(start: Callable[..., Supervisor], drone: FakeDrone) -> None:
    supervisor = start(table(drone, "flying"))
    guardian, driver = supervisor.processes
    pids = guardian.pid, driver.pid
    os.kill(guardian.pid, signal.SIGKILL)
    until(supervisor, lambda: guardian.is_up and guardian.pid != pids[0])
    os.kill(guardian.pid, signal.SIGSTOP)
    pids = guardian.pid, driver.pid
    until(supervisor, lambda: guardian.is_up and guardian.pid != pids[0])
    assert driver.pid == pids[1]
    began = time.monotonic()
    supervisor.stop()
    assert time.monotonic() - began < 1.5
    assert {data for _, data in drone.listen(0.1)} == {b"fly"}


def test_lands_a_drone_whose_driver_is_killed_during_the_stop(
    start: Callable[..., Supervisor], drone: FakeDrone
) -> None:
    supervisor = start(table(drone, "deaf", stop_limit_s=0.2))
    supervisor.stop()
    said = [data for _, data in drone.listen(0.1)]
    assert said[0] == b"hover" and said[-1] == b"land"
    assert not any(process.running for process in supervisor.processes)


def test_a_drone_whose_driver_returns_in_flight_is_stopped_and_landed(
    start: Callable[..., Supervisor], drone: FakeDrone, tmp_path: Path
) -> None:
    supervisor = start(table(drone, "gives_up", restart_delay_s=60.0))
    driver = supervisor.processes[1]
    until(supervisor, lambda: driver.restart_due_ns is not None)
    assert not driver.left_when_told(), "nobody told it"
    supervisor.step()
    assert {data for _, data in drone.listen(0.1)} == {b"hover"}
    assert "drone_1: ended without an order to: the supervisor tells its drone to hover" in said_on(tmp_path)
    supervisor.stop()
    said = [data for _, data in drone.listen(0.1)]
    assert said.index(b"land") and set(said[said.index(b"land") :]) == {b"land"}


def test_a_drone_whose_driver_returns_during_the_stop_is_landed(
    start: Callable[..., Supervisor], drone: FakeDrone
) -> None:
    supervisor = start(table(drone, "returns_when_told"))
    supervisor.stop()
    said = [data for _, data in drone.listen(0.1)]
    assert said[0] == b"hover" and said[-1] == b"land"


def test_a_drone_whose_driver_returns_without_a_supervisor_is_landed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, drone: FakeDrone
) -> None:
    monkeypatch.setenv("PYTHONPATH", f"{HERE}:{os.environ.get('PYTHONPATH', '')}")
    with closing(SupervisedRun(tmp_path / "run", table(drone, "returns_when_told"))) as run:
        run.process.kill()
        run.until_gone("drone_1")
        said = [data for _, data in drone.listen(LAND_AFTER_S + 0.5)]
        assert said[0] == b"hover" and said[-1] == b"land"


def test_a_driver_that_cannot_be_killed_is_left_behind(
    start: Callable[..., Supervisor], drone: FakeDrone, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("groundstation.supervisor.supervisor._KERNEL_S", 0.2)
    supervisor = start(table(drone, "deaf", stop_limit_s=0.2)[1:])
    (driver,) = supervisor.processes
    with monkeypatch.context() as kernel:
        kernel.setattr(ManagedProcess, "signal_group", lambda self, number: None)
        supervisor.stop()
    assert not driver.running
    os.kill(driver.pid, signal.SIGKILL)
    os.waitpid(driver.pid, 0)


@pytest.mark.parametrize("carried", [True, False])
def test_only_words_that_are_carried_count_as_spoken(monkeypatch: pytest.MonkeyPatch, carried: bool) -> None:
    def refused(*_: object) -> None:
        raise OSError("no such device")

    if not carried:
        monkeypatch.setattr("groundstation.supervisor.failsafe_sender.open_transport", refused)
    sender = FailsafeSender()
    words = FailsafeDatagrams("127.0.0.1", 5556, b"hover", b"land", 20.0)
    assert sender.began_ns("drone_1") == 0
    sender.begin("drone_1", words, 1)
    assert (sender.began_ns("drone_1") > 0) is carried
    sender.end("drone_1")
    assert sender.began_ns("drone_1") == 0
    sender.close()


def test_a_stop_waits_for_the_guardian_as_long_as_hover_and_landing_take() -> None:
    words = FailsafeDatagrams("127.0.0.1", 5556, b"hover", b"land", 20.0)
    guardian, _ = guarded((spec("drone_1", "dummies:flying", failsafe_datagrams=words),))
    assert guardian.stop_limit_s >= 20.0 + msgspec.json.decode(guardian.section, type=GuardOrder).landing_s
