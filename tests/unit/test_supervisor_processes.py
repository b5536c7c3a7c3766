"""The supervisor against real dummy children: crash, hang, slow start, deaf to SIGTERM; and its own death."""

import json
import os
import signal
import socket
import subprocess
import sys
import textwrap
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from groundstation.errors import GroundStationError
from groundstation.supervisor import runtime_file
from groundstation.supervisor.supervisor import Interrupted, Run, Supervisor
from groundstation.supervisor.table import LastWords, ProcessSpec, Restart, StopOrder
from groundstation.supervisor.terminal import Terminal

DUMMIES = """
import json, signal, sys, time

def turn(child):
    child.beat(); child.tick_status()
    child.sleep_until(time.monotonic_ns() + 20_000_000)

def obedient(child):
    settings = json.loads(child.section)
    time.sleep(settings.get("slow_s", 0))
    if settings.get("hoarse_s"):
        child.degrade("no picture")
        time.sleep(settings["hoarse_s"])
    print("epoch", settings.get("epoch"), flush=True)
    child.ready("fine")
    while not child.stop_requested and child.supervisor_alive:
        turn(child)
    if not child.supervisor_alive:
        print("orphan leaves", flush=True)
    return 0

def deaf(child):
    signal.signal(signal.SIGTERM, signal.SIG_IGN)
    child.ready()
    while True:
        turn(child)

def crashing(child):
    raise RuntimeError("no luck")

def never_ready(child):
    child.starting("waiting for a drone")
    while not child.stop_requested and child.supervisor_alive:
        turn(child)
    return 0
"""


def free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


@pytest.fixture
def make(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Callable[..., Supervisor]]:
    (tmp_path / "dummies.py").write_text(DUMMIES)
    runtime = tmp_path / "runtime"
    runtime.mkdir()
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(runtime))
    handlers = {number: signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)}
    made: list[Supervisor] = []
    sink = os.open(tmp_path / "terminal", os.O_WRONLY | os.O_CREAT)

    def build(*specs: ProcessSpec) -> Supervisor:
        endpoint = f"tcp/127.0.0.1:{free_port()}"
        router = ProcessSpec(
            "router",
            "router",
            entry="groundstation.runtime.router:run",
            section=json.dumps({"endpoint": endpoint}),
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


def spec(name: str, entry: str, **options: object) -> ProcessSpec:
    return ProcessSpec(name, "driver", entry=f"dummies:{entry}", **options)  # type: ignore[arg-type]


def until(supervisor: Supervisor, condition: Callable[[], bool], limit_s: float = 15.0) -> None:
    deadline = time.monotonic() + limit_s
    while not condition():
        assert time.monotonic() < deadline, "never happened"
        supervisor.step()


def test_starts_router_first_and_stops_in_order(make: Callable[..., Supervisor]) -> None:
    supervisor = make(spec("drone_1", "obedient"), spec("recorder", "obedient", stop_order=StopOrder.RECORDS))
    supervisor.start()
    router, driver, recorder = supervisor.processes
    assert all(process.is_up for process in supervisor.processes)
    assert router.started_ns < driver.started_ns < recorder.started_ns
    ended: list[str] = []
    original = supervisor.step

    def step(timeout_s: float = 0.05) -> None:
        original(timeout_s)
        ended.extend(p.spec.name for p in supervisor.processes if not p.running and p.spec.name not in ended)

    supervisor.step = step  # type: ignore[method-assign]
    supervisor.stop()
    assert ended == ["drone_1", "recorder", "router"]


def test_children_ignore_the_terminals_interrupt(make: Callable[..., Supervisor]) -> None:
    supervisor = make(spec("drone_1", "obedient"))
    supervisor.start()
    pid = supervisor.processes[1].pid
    assert os.getsid(pid) == pid
    os.kill(pid, signal.SIGINT)
    for _ in range(10):
        supervisor.step()
    assert supervisor.processes[1].is_up and supervisor.processes[1].pid == pid


def test_restarts_a_killed_process_with_a_new_epoch(make: Callable[..., Supervisor], tmp_path: Path) -> None:
    supervisor = make(spec("tracker", "obedient", section='{"epoch": 7}', numbered=True))
    supervisor.start()
    tracker = supervisor.processes[1]
    pid = tracker.pid
    os.kill(pid, signal.SIGKILL)
    until(supervisor, lambda: tracker.is_up and tracker.pid != pid)
    log = (tmp_path / "run/log/tracker.log").read_text()
    assert "epoch 7\n" in log and "epoch 8\n" in log


def test_even_a_first_restart_waits_where_the_table_says_so(make: Callable[..., Supervisor]) -> None:
    supervisor = make(spec("relay", "obedient", restart_delay_s=0.5))
    supervisor.start()
    relay = supervisor.processes[1]
    pid, killed_ns = relay.pid, time.monotonic_ns()
    os.kill(pid, signal.SIGKILL)
    until(supervisor, lambda: relay.is_up and relay.pid != pid)
    assert relay.started_ns - killed_ns >= 500_000_000


def test_frozen_process_gets_last_words_then_is_replaced(make: Callable[..., Supervisor]) -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as drone:
        drone.bind(("127.0.0.1", 0))
        drone.setblocking(False)
        words = LastWords("127.0.0.1", drone.getsockname()[1], b"hover", b"land", land_after_s=0.0)
        supervisor = make(
            spec("drone_1", "obedient", last_words=words, silence_limit_s=0.4, hang_limit_s=1.5),
            spec("drone_2", "obedient"),
        )
        supervisor.start()
        driver, other = supervisor.processes[1:]
        pids = driver.pid, other.pid
        os.kill(driver.pid, signal.SIGSTOP)
        until(supervisor, lambda: driver.pid != pids[0] and driver.is_up)
        for _ in range(3):
            supervisor.step()
        assert other.pid == pids[1], "only the silent one is replaced"
        heard = []
        with pytest.raises(BlockingIOError):
            while True:
                heard.append(drone.recv(100))
        assert heard and set(heard) <= {b"hover", b"land"} and b"land" in heard
        for _ in range(6):
            supervisor.step()
        with pytest.raises(BlockingIOError):
            drone.recv(100)


def test_a_freeze_of_the_supervisor_itself_is_nobodys_fault(make: Callable[..., Supervisor]) -> None:
    supervisor = make(spec("drone_1", "obedient", silence_limit_s=0.4, hang_limit_s=0.8))
    supervisor.start()
    driver = supervisor.processes[1]
    pid = driver.pid
    os.kill(pid, signal.SIGSTOP)  # both stand still, as when the whole host is suspended
    time.sleep(1.2)
    os.kill(pid, signal.SIGCONT)
    for _ in range(5):
        supervisor.step()
    assert driver.pid == pid and driver.is_up


def test_deaf_process_is_killed_after_its_deadline(make: Callable[..., Supervisor]) -> None:
    supervisor = make(spec("drone_1", "deaf", stop_limit_s=0.3))
    supervisor.start()
    supervisor.stop()
    assert not any(process.running for process in supervisor.processes)


def test_crash_of_a_required_process_at_start_names_its_log(make: Callable[..., Supervisor]) -> None:
    supervisor = make(spec("tracker", "crashing"))
    with pytest.raises(GroundStationError, match=r"tracker ended with code 1.*(?s:.*)no luck"):
        supervisor.start()


def test_optional_process_is_retried_with_back_off_and_does_not_hold_the_start(
    make: Callable[..., Supervisor], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("groundstation.supervisor.supervisor._OPTIONAL_GRACE_S", 1.0)
    supervisor = make(spec("ceiling", "crashing", required=False), spec("drone_1", "never_ready", required=False))
    supervisor.start()
    camera = supervisor.processes[1]
    assert 2 <= camera.life <= 4
    assert not supervisor.failure
    assert supervisor.unwell == ["ceiling", "drone_1"]


def test_late_start_is_waited_for_and_a_recovery_told(make: Callable[..., Supervisor], tmp_path: Path) -> None:
    supervisor = make(spec("ceiling", "obedient", section='{"slow_s": 0.7, "hoarse_s": 0.4}'))
    supervisor.start()
    until(supervisor, lambda: "ceiling      ready  fine" in (tmp_path / "terminal").read_text())


def test_end_of_what_the_run_stands_on_ends_the_run(make: Callable[..., Supervisor]) -> None:
    supervisor = make(spec("sim_bridge", "obedient", restart=Restart.ENDS_RUN))
    supervisor.start()
    os.kill(supervisor.processes[1].pid, signal.SIGKILL)
    until(supervisor, lambda: bool(supervisor.failure))
    assert "sim_bridge killed by SIGKILL" in supervisor.failure


def test_router_comes_back_on_the_same_port(make: Callable[..., Supervisor]) -> None:
    supervisor = make(spec("drone_1", "obedient"))
    supervisor.start()
    router = supervisor.processes[0]
    pid = router.pid
    os.kill(pid, signal.SIGKILL)
    until(supervisor, lambda: router.is_up and router.pid != pid)
    assert supervisor.processes[1].is_up


def test_signal_while_starting_interrupts(make: Callable[..., Supervisor]) -> None:
    supervisor = make(spec("tracker", "never_ready"))
    original = supervisor.step

    def step(timeout_s: float = 0.05) -> None:
        original(timeout_s)
        if supervisor.processes[1].running:
            os.kill(os.getpid(), signal.SIGINT)

    supervisor.step = step  # type: ignore[method-assign]
    with pytest.raises(Interrupted):
        supervisor.start()


def test_unwritable_run_folder_is_named(make: Callable[..., Supervisor], tmp_path: Path) -> None:
    (tmp_path / "run").write_text("in the way")
    with pytest.raises(GroundStationError, match="cannot write to the run folder"):
        make(spec("drone_1", "obedient")).start()


def test_runtime_file_lives_as_long_as_the_run(make: Callable[..., Supervisor]) -> None:
    supervisor = make(spec("drone_1", "obedient"))
    supervisor.start()
    (record,) = runtime_file.live_records()
    assert record.endpoint == supervisor.run.endpoint
    assert {process.name for process in record.processes} == {"router", "drone_1"}
    supervisor.close()
    assert runtime_file.live_records() == []


def test_killed_supervisor_leaves_no_orphan(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "dummies.py").write_text(DUMMIES)
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    script = f"""
        import json
        from pathlib import Path
        from groundstation.supervisor.supervisor import Run, Supervisor
        from groundstation.supervisor.table import *
        from groundstation.supervisor.terminal import Terminal
        endpoint = "tcp/127.0.0.1:{free_port()}"
        table = (
            ProcessSpec("router", "router", entry="groundstation.runtime.router:run", on_bus=False,
                        section=json.dumps(dict(endpoint=endpoint)), stop_order=StopOrder.CONNECTS),
            ProcessSpec("drone_1", "driver", entry="dummies:obedient"),
        )
        terminal = Terminal()
        supervisor = Supervisor(Run("lab", "lab", endpoint, Path("{tmp_path}/run"), ()), table, terminal)
        supervisor.start()
        terminal.say("up")
        while True:
            supervisor.step()
    """
    command = [sys.executable, "-c", textwrap.dedent(script)]
    with subprocess.Popen(command, stdout=subprocess.PIPE) as process:
        try:
            assert process.stdout is not None
            assert b"up\n" in process.stdout
            (record,) = runtime_file.live_records()
        finally:
            process.kill()
    deadline = time.monotonic() + 10
    while record.alive:
        assert time.monotonic() < deadline, "orphans remain"
        time.sleep(0.02)
    assert "orphan leaves" in (tmp_path / "run/log/drone_1.log").read_text()
    assert Path(record.heartbeat).exists()
    assert runtime_file.live_records() == []
    assert not Path(record.heartbeat).exists()
