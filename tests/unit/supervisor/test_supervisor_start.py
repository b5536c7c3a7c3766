"""Start of a run: in order, patient, and limited in time."""

import errno
import os
import signal
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace

import pytest
from dummy_table import spec, start, until

from groundstation.errors import GroundStationError
from groundstation.flight.flight_plan import FlightPlan
from groundstation.flight.loop import Flight
from groundstation.process.heartbeat import SlotState
from groundstation.runtime.take_off import TakeOffLimits
from groundstation.supervisor import runtime_file
from groundstation.supervisor.process_spec import ProcessSpec, StopOrder
from groundstation.supervisor.start import Interrupted
from groundstation.supervisor.supervisor import Supervisor
from groundstation.supervisor.terminal import Terminal
from groundstation.supervisor.waiting import Waiting


def test_starts_router_first_and_stops_in_order(make: Callable[..., Supervisor]) -> None:
    supervisor = make(spec("drone_1", "obedient"), spec("recorder", "obedient", stop_order=StopOrder.RECORDS))
    start(supervisor)
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


@pytest.mark.parametrize("hurry", [False, True])
def test_the_console_stays_until_the_run_is_judged_unless_hurried(make: Callable[..., Supervisor], hurry: bool) -> None:
    supervisor = make(spec("drone_1", "obedient"), spec("console", "obedient", shows_end=True))
    start(supervisor)
    router, driver, console = supervisor.processes
    supervisor.interrupts.hurry = hurry
    supervisor.end_run()
    assert (router.running, driver.running, console.running) == (False, False, not hurry)
    assert supervisor.bus is None and not runtime_file.live_records()
    supervisor.close()
    assert not console.running
    assert runtime_file.start_time(console.pid) is None, "an orphan remains"


def test_its_loop_goes_first_while_it_watches_and_nothing_that_it_started(make: Callable[..., Supervisor]) -> None:
    supervisor = make(spec("drone_1", "obedient", nice=-5), spec("recorder", "obedient"))
    start(supervisor)
    allowed = os.sched_getscheduler(0) & ~os.SCHED_RESET_ON_FORK == os.SCHED_RR
    pids = [process.pid for process in supervisor.processes[1:]]
    assert [os.sched_getscheduler(pid) for pid in pids] == [os.SCHED_OTHER] * 2
    assert [os.getpriority(os.PRIO_PROCESS, pid) for pid in pids] == ([-5, 0] if allowed else [0, 5])
    supervisor.close()
    assert (os.sched_getscheduler(0), os.getpriority(os.PRIO_PROCESS, 0)) == (os.SCHED_OTHER, 0)


def test_crash_of_a_required_process_at_start_names_its_log(make: Callable[..., Supervisor]) -> None:
    supervisor = make(spec("tracker", "crashing"))
    with pytest.raises(GroundStationError, match=r"tracker ended with code 1.*(?s:.*)no luck"):
        start(supervisor)


def test_devices_begin_once_what_emulates_them_answers(make: Callable[..., Supervisor]) -> None:
    supervisor = make(
        spec("drone_1", "obedient", required=False), spec("sim_bridge", "obedient", section='{"slow_s": 0.7}')
    )
    start(supervisor)
    driver, sim_bridge = supervisor.processes[1:]
    assert driver.started_ns - sim_bridge.started_ns > 700_000_000


def test_optional_process_is_retried_with_back_off_and_does_not_hold_the_start(
    make: Callable[..., Supervisor], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("groundstation.supervisor.start._OPTIONAL_GRACE_S", 0.3)
    supervisor = make(spec("ceiling", "crashing", required=False), spec("drone_1", "never_ready", required=False))
    start(supervisor)
    camera = supervisor.processes[1]
    assert 2 <= camera.life <= 4
    assert not supervisor.failure
    assert supervisor.unwell == ["ceiling", "drone_1"]
    told = (tmp_path / "terminal").read_text()
    assert "ceiling: ended with code 1: RuntimeError: no luck; restarting" in told


def test_the_reason_of_an_end_is_told_though_no_status_came(
    make: Callable[..., Supervisor], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("groundstation.supervisor.start._OPTIONAL_GRACE_S", 0.3)
    supervisor = make(spec("ceiling", "crashing", required=False, on_bus=False))
    start(supervisor)
    camera = supervisor.processes[1]
    until(supervisor, lambda: camera.life == 3)
    told = (tmp_path / "terminal").read_text()
    assert told.count("ceiling: ended with code 1: RuntimeError: no luck; restarting") == 2


@pytest.mark.parametrize(("awaited", "up"), [(True, True), (False, False)])
def test_a_slow_process_delays_the_start_only_if_awaited(
    make: Callable[..., Supervisor], tmp_path: Path, monkeypatch: pytest.MonkeyPatch, awaited: bool, up: bool
) -> None:
    monkeypatch.setattr("groundstation.supervisor.start._OPTIONAL_GRACE_S", 0.5)
    supervisor = make(spec("diagnosis", "obedient", required=False, awaited=awaited, section='{"slow_s": 2.0}'))
    start(supervisor)
    diagnosis = supervisor.processes[1]
    assert diagnosis.is_up is up
    assert not supervisor.unwell
    until(supervisor, lambda: diagnosis.is_up)
    assert "not ready" not in (tmp_path / "terminal").read_text()


def test_late_start_is_waited_for_and_a_recovery_told(make: Callable[..., Supervisor], tmp_path: Path) -> None:
    supervisor = make(spec("ceiling", "obedient", section='{"slow_s": 0.7, "hoarse_s": 0.4}'))
    start(supervisor)
    until(supervisor, lambda: "ceiling      ready  fine" in (tmp_path / "terminal").read_text())


@pytest.mark.parametrize(("grace_s", "up"), [(5.0, []), (None, ["ceiling"])], ids=["optional", "required"])
def test_a_device_that_may_still_answer_is_waited_for(grace_s: float | None, up: list[str]) -> None:
    row = SimpleNamespace(name="ceiling", start_limit_s=60.0)
    ceiling = SimpleNamespace(spec=row, is_up=True, begins=False, life=1, state=SlotState.DEGRADED)

    def taken() -> list[str]:
        waiting.take_up()  # a process that dies of its first work is not up: only the second check counts
        return [process.spec.name for process in waiting.take_up()]

    waiting = Waiting([ceiling], 0.0, grace_s)  # type: ignore[list-item]
    assert (taken(), waiting.take_late(10.0), waiting.take_late(14.9)) == (up, [], [])
    ceiling.state = SlotState.READY
    assert up + taken() == ["ceiling"]


def test_signal_while_starting_interrupts(make: Callable[..., Supervisor]) -> None:
    supervisor = make(spec("tracker", "never_ready"))
    original = supervisor.step

    def step(timeout_s: float = 0.05) -> None:
        original(timeout_s)
        if supervisor.processes[1].running:
            os.kill(os.getpid(), signal.SIGINT)

    supervisor.step = step  # type: ignore[method-assign]
    with pytest.raises(Interrupted):
        start(supervisor)


def test_unwritable_run_folder_is_named(make: Callable[..., Supervisor], tmp_path: Path) -> None:
    (tmp_path / "run").write_text("in the way")
    with pytest.raises(GroundStationError, match="cannot write to the run folder"):
        start(make(spec("drone_1", "obedient")))


def nowhere(name: str, **options: object) -> ProcessSpec:
    return ProcessSpec(name, "sim_bridge", command=("/nowhere/program",), **options)  # type: ignore[arg-type]


def test_required_process_that_cannot_be_executed_ends_the_start(make: Callable[..., Supervisor]) -> None:
    supervisor = make(spec("tracker", "never_ready"), nowhere("sim_bridge"), spec("recorder", "obedient"))
    flight = Flight(supervisor, FlightPlan(None, asks=False, cameras={}, limits=TakeOffLimits()), Terminal())
    with pytest.raises(GroundStationError, match=r"^sim_bridge cannot be started: No such file.*: /nowhere/program$"):
        flight.run()
    router, tracker, sim_bridge, recorder = supervisor.processes
    assert (tracker.life, sim_bridge.life, recorder.life) == (1, 0, 0)
    for process in (router, tracker):
        assert process.pid and runtime_file.start_time(process.pid) is None, "an orphan remains"


def test_optional_process_that_cannot_be_executed_holds_nobody(
    make: Callable[..., Supervisor], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("groundstation.supervisor.start._OPTIONAL_GRACE_S", 0.5)
    supervisor = make(nowhere("ceiling", required=False))
    start(supervisor)
    assert not supervisor.failure and supervisor.processes[0].is_up


def test_process_that_cannot_be_watched_is_ended(
    make: Callable[..., Supervisor], monkeypatch: pytest.MonkeyPatch
) -> None:
    started: list[int] = []

    def refuse(pid: int) -> int:
        started.append(pid)
        raise OSError(errno.EMFILE, os.strerror(errno.EMFILE))

    monkeypatch.setattr(os, "pidfd_open", refuse)
    with pytest.raises(GroundStationError, match="router cannot be started: Too many open files"):
        start(make())
    with pytest.raises(ChildProcessError):
        os.waitid(os.P_PID, started[0], os.WEXITED | os.WNOHANG)


def test_required_process_that_never_stays_up_ends_the_start(make: Callable[..., Supervisor]) -> None:
    supervisor = make(spec("tracker", "killed_when_ready", start_limit_s=3.0))
    with pytest.raises(GroundStationError, match="tracker is not ready 3 s after the start; its log"):
        start(supervisor)
    assert supervisor.processes[1].life > 1
