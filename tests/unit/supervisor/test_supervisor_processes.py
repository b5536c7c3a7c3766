"""The supervisor with real children: crash, hang, ignored SIGTERM; and its own death."""

import os
import signal
import socket
import subprocess
import sys
import textwrap
import time
from collections.abc import Callable
from pathlib import Path

import pytest
from dummy_table import spec, start, until
from free_port import free_port

from groundstation.supervisor import managed_process, runtime_file
from groundstation.supervisor.process_spec import FailsafeDatagrams, Restart
from groundstation.supervisor.supervisor import Supervisor


def test_children_ignore_the_terminals_interrupt(make: Callable[..., Supervisor]) -> None:
    supervisor = make(spec("drone_1", "obedient"))
    start(supervisor)
    pid = supervisor.processes[1].pid
    assert os.getsid(pid) == pid
    os.kill(pid, signal.SIGINT)
    for _ in range(10):
        supervisor.step()
    assert supervisor.processes[1].is_up and supervisor.processes[1].pid == pid


def test_restarts_a_killed_process_with_a_new_epoch(make: Callable[..., Supervisor], tmp_path: Path) -> None:
    supervisor = make(spec("tracker", "obedient", section='{"epoch": 7}', numbered=True))
    start(supervisor)
    tracker = supervisor.processes[1]
    pid = tracker.pid
    os.kill(pid, signal.SIGKILL)
    until(supervisor, lambda: tracker.is_up and tracker.pid != pid)
    log = (tmp_path / "run/log/tracker.log").read_text()
    assert "epoch 7\n" in log and "epoch 8\n" in log


def test_a_process_is_replaced_though_ends_of_children_are_ignored(make: Callable[..., Supervisor]) -> None:
    """Ignoring SIGCHLD is inherited over exec, and then the kernel forgets each child at its end."""
    signal.signal(signal.SIGCHLD, signal.SIG_IGN)
    supervisor = make(spec("ceiling", "obedient"))
    start(supervisor)
    camera = supervisor.processes[1]
    pid = camera.pid
    os.kill(pid, signal.SIGKILL)
    until(supervisor, lambda: camera.is_up and camera.pid != pid)
    supervisor.stop()
    assert not any(process.running for process in supervisor.processes)


def test_a_process_is_replaced_though_the_heartbeat_file_was_removed(make: Callable[..., Supervisor]) -> None:
    """systemd removes the files in /dev/shm of a user who logs out."""
    supervisor = make(spec("tracker", "obedient"))
    start(supervisor)
    (record,) = runtime_file.live_records()
    Path(record.heartbeat).unlink()
    tracker = supervisor.processes[1]
    pid = tracker.pid
    os.kill(pid, signal.SIGKILL)
    until(supervisor, lambda: tracker.is_up and tracker.pid != pid)


def test_a_process_whose_end_somebody_else_collected_is_replaced(make: Callable[..., Supervisor]) -> None:
    supervisor = make(spec("ceiling", "obedient"))
    start(supervisor)
    camera = supervisor.processes[1]
    pid = camera.pid
    os.kill(pid, signal.SIGKILL)
    os.waitpid(pid, 0)
    until(supervisor, lambda: camera.is_up and camera.pid != pid)


@pytest.mark.parametrize(("number", "told"), [(signal.SIGTERM, True), (signal.SIGKILL, False)])
def test_a_driver_that_somebody_told_to_end_is_known_once_from_one_that_died(
    make: Callable[..., Supervisor], number: int, told: bool
) -> None:
    supervisor = make(spec("drone_1", "obedient"))
    start(supervisor)
    driver = supervisor.processes[1]
    pid = driver.pid
    assert not driver.left_when_told()
    os.kill(pid, number)
    until(supervisor, lambda: not driver.running)
    assert driver.left_when_told() is told and not driver.left_when_told()
    until(supervisor, lambda: driver.is_up and driver.pid != pid)
    assert not driver.left_when_told()


def test_even_a_first_restart_waits_where_the_table_says_so(make: Callable[..., Supervisor]) -> None:
    supervisor = make(spec("relay", "obedient", restart_delay_s=0.5))
    start(supervisor)
    relay = supervisor.processes[1]
    pid, killed_ns = relay.pid, time.monotonic_ns()
    os.kill(pid, signal.SIGKILL)
    until(supervisor, lambda: relay.is_up and relay.pid != pid)
    assert relay.started_ns - killed_ns >= 500_000_000


def test_frozen_process_gets_last_words_then_is_replaced(make: Callable[..., Supervisor]) -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as drone:
        drone.bind(("127.0.0.1", 0))
        drone.setblocking(False)
        words = FailsafeDatagrams("127.0.0.1", drone.getsockname()[1], b"hover", b"land", land_after_s=0.0)
        supervisor = make(
            spec("drone_1", "obedient", failsafe_datagrams=words, silence_limit_s=0.4, hang_limit_s=1.5),
            spec("drone_2", "obedient"),
        )
        start(supervisor)
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


def test_a_process_waiting_for_a_core_is_not_restarted_as_hanging(
    make: Callable[..., Supervisor], monkeypatch: pytest.MonkeyPatch
) -> None:
    supervisor = make(spec("ceiling", "obedient", silence_limit_s=0.4, hang_limit_s=0.6))
    start(supervisor)
    camera, heard = supervisor.processes[1], []
    monkeypatch.setattr(supervisor.events, "event", lambda *words: heard.append(words[2]))
    monkeypatch.setattr(managed_process, "all_waited_ns", lambda pid: time.monotonic_ns())
    pid, begin = camera.pid, time.monotonic()
    os.kill(pid, signal.SIGSTOP)  # no heartbeat, and the kernel reports that it waits
    until(supervisor, lambda: time.monotonic() > begin + 1.2)
    assert camera.pid == pid and not camera.kill_reason
    assert heard == ["gets no core of the processor: this computer is too busy"]
    until(supervisor, lambda: camera.pid != pid and camera.is_up)  # but with a time limit


def test_the_plug_in_of_a_hanging_process_is_named(
    make: Callable[..., Supervisor], monkeypatch: pytest.MonkeyPatch
) -> None:
    supervisor = make(spec("tracker", "obedient", hang_limit_s=0.5, guest="planner calm (my-lab)"))
    start(supervisor)
    tracker, heard = supervisor.processes[1], []
    monkeypatch.setattr(supervisor.events, "event", lambda *words: heard.append(words[2]))
    os.kill(tracker.pid, signal.SIGSTOP)  # as a call that holds the interpreter
    until(supervisor, lambda: any("restarting" in text for text in heard))
    assert any("hung: no heartbeat for" in text and "planner calm (my-lab) runs in it" in text for text in heard), heard


def test_a_freeze_of_the_supervisor_itself_is_nobodys_fault(make: Callable[..., Supervisor]) -> None:
    supervisor = make(spec("drone_1", "obedient", silence_limit_s=0.4, hang_limit_s=0.8))
    start(supervisor)
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
    start(supervisor)
    supervisor.stop()
    assert not any(process.running for process in supervisor.processes)


def test_end_of_what_the_run_stands_on_ends_the_run(make: Callable[..., Supervisor]) -> None:
    supervisor = make(spec("sim_bridge", "obedient", restart=Restart.ENDS_RUN))
    start(supervisor)
    os.kill(supervisor.processes[1].pid, signal.SIGKILL)
    until(supervisor, lambda: bool(supervisor.failure))
    assert "sim_bridge killed by SIGKILL" in supervisor.failure


def test_router_comes_back_on_the_same_port(make: Callable[..., Supervisor]) -> None:
    supervisor = make(spec("drone_1", "obedient"))
    start(supervisor)
    router = supervisor.processes[0]
    pid = router.pid
    os.kill(pid, signal.SIGKILL)
    until(supervisor, lambda: router.is_up and router.pid != pid)
    assert supervisor.processes[1].is_up


def test_runtime_file_lives_as_long_as_the_run(make: Callable[..., Supervisor]) -> None:
    supervisor = make(spec("drone_1", "obedient"))
    start(supervisor)
    (record,) = runtime_file.live_records()
    assert record.endpoint == supervisor.run.endpoint
    assert {process.name for process in record.processes} == {"router", "drone_1"}
    supervisor.close()
    assert runtime_file.live_records() == []


def test_killed_supervisor_leaves_no_orphan(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    monkeypatch.setenv("PYTHONPATH", str(Path(__file__).parent))
    script = f"""
        import json
        from pathlib import Path
        from groundstation.supervisor.start import Start
        from groundstation.supervisor.run import Run
        from groundstation.supervisor.supervisor import Supervisor
        from groundstation.supervisor.process_spec import *
        from groundstation.supervisor.terminal import Terminal
        endpoint = "tcp/127.0.0.1:{free_port()}"
        table = (
            ProcessSpec("router", "router", entry="groundstation.runtime.router:run", on_bus=False,
                        section=json.dumps(dict(endpoint=endpoint)), stop_order=StopOrder.CONNECTS),
            ProcessSpec("drone_1", "driver", entry="dummies:obedient"),
        )
        terminal = Terminal()
        supervisor = Supervisor(Run("lab", "lab", endpoint, Path("{tmp_path}/run"), ()), table, terminal)
        Start(supervisor).run()
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
