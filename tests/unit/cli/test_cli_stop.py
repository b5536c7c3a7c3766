"""`hold`, `land`, `cut-motors` against fake drivers over real Zenoh, and without a router."""

import json
import os
import signal
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from msgspec import structs

from groundstation.bus.messages import AckStage, Command, CommandAck, Header, Lease, Verb
from groundstation.bus.topics import COMMAND, COMMAND_ACK, LEASE
from groundstation.bus.zenoh_bus import open_bus, open_router
from groundstation.cli import stop
from groundstation.cli.exits import UnreachableError
from groundstation.supervisor import runtime_file
from groundstation.supervisor.runtime_file import ProcessRecord, RuntimeRecord


class FakeTeam:
    """A router, and drones that acknowledge as far as configured."""

    def __init__(self, answers: dict[str, list[tuple[AckStage, str]]]) -> None:
        with socket.socket() as probe:
            probe.bind(("127.0.0.1", 0))
            self.endpoint = f"tcp/127.0.0.1:{probe.getsockname()[1]}"
        self.router = open_router(self.endpoint)
        self.answers = answers
        self.heard: list[Command] = []
        self.buses = {name: open_bus(self.endpoint, "lab", name) for name in answers}
        self.commands = {name: bus.subscribe([COMMAND]) for name, bus in self.buses.items()}
        self.stop = threading.Event()
        self.thread = threading.Thread(target=self.serve)
        self.thread.start()

    def serve(self) -> None:
        while not self.stop.wait(0.01):
            for name, commands in self.commands.items():
                for received in commands.drain():
                    assert isinstance(received.message, Command)
                    self.answer(name, received.message)

    def answer(self, name: str, command: Command) -> None:
        self.heard.append(command)
        bus = self.buses[name]
        for stage, reason in self.answers[name]:
            header = bus.header(name)
            ack = CommandAck(header=header, command_id=command.id, verb=command.verb, stage=stage, reason=reason)
            bus.publish(COMMAND_ACK, ack)

    def close(self) -> None:
        self.stop.set()
        self.thread.join()
        for bus in self.buses.values():
            bus.close()
        self.router.close()


FULL = [(AckStage.RECEIVED, ""), (AckStage.ACCEPTED, ""), (AckStage.EFFECTIVE, "")]


@pytest.fixture
def runtime(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    return tmp_path


@pytest.fixture
def alone(runtime: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """No run is seen but those of the test."""
    for name in ("_SESSIONS", "_SERVICE", "_SHARED"):
        monkeypatch.setattr(runtime_file, name, runtime)
    monkeypatch.setenv("XDG_CONFIG_HOME", str(runtime))
    return runtime


@pytest.fixture
def team(runtime: Path) -> Iterator[FakeTeam]:
    made = FakeTeam({"drone_1": FULL, "drone_2": FULL})
    announce(made.endpoint)
    yield made
    made.close()


def announce(endpoint: str, site: str = "lab", processes: tuple[ProcessRecord, ...] = ()) -> None:
    pid = os.getpid()
    supervisor = ProcessRecord("supervisor", "supervisor", pid, runtime_file.start_time(pid) or 0)
    drones = ("drone_1", "drone_2")
    runtime_file.write(RuntimeRecord(site, "lab.yaml", endpoint, "runs/x", "", drones, supervisor, processes))


def cli(*arguments: str, given: str = "") -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "groundstation", *arguments]
    return subprocess.run(command, capture_output=True, text=True, timeout=60, input=given, check=False)


def answers_of(result: subprocess.CompletedProcess[str]) -> Any:
    return json.loads(result.stdout)["drones"]


def test_confirmed_stop_says_how_far_each_drone_came(team: FakeTeam) -> None:
    result = cli("land")
    assert result.returncode == 0, result.stderr
    for name in ("drone_1", "drone_2"):
        assert f"{name:<12} sent / received / accepted / effective" in result.stdout
    assert team.heard[0].expires_ns == 0 and team.heard[0].scope == ()


def test_refused_and_silent_drones_are_not_confirmed(team: FakeTeam) -> None:
    team.answers["drone_1"] = [(AckStage.RECEIVED, ""), (AckStage.REFUSED, "on the ground")]
    team.answers["drone_2"] = []
    result = cli("hold", "--json")
    assert result.returncode == 4
    document = json.loads(result.stdout)
    assert document["confirmed"] is False
    assert document["drones"]["drone_1"] == {"stage": "REFUSED", "reason": "on the ground"}
    assert document["drones"]["drone_2"]["stage"] == "NOT CONFIRMED"
    assert len({command.id for command in team.heard}) == 1 and len(team.heard) > 3, "repeated under the same id"
    assert cli("hold").stdout.count("refused: on the ground") == 1


def test_named_drone_only(team: FakeTeam) -> None:
    assert set(answers_of(cli("land", "drone_2", "--json"))) == {"drone_2"}
    assert all(command.scope == ("drone_2",) for command in team.heard)
    result = cli("land", "drone_9")
    assert result.returncode == 2 and "there is no drone drone_9" in result.stderr


@pytest.mark.parametrize("verb", ["land", "hold", "cut-motors"])
def test_a_mistyped_name_keeps_no_other_drone_from_stopping(team: FakeTeam, verb: str) -> None:
    """In an emergency nobody types twice."""
    result = cli(verb, "drone_9", "drone_2", "--json", *(["--yes"] if verb == "cut-motors" else []))
    assert result.returncode == 4, "a drone that was meant flies on"
    assert set(answers_of(result)) == {"drone_2"}
    assert team.heard and all(command.scope == ("drone_2",) for command in team.heard)
    assert "there is no drone drone_9, there are: drone_1, drone_2" in result.stderr


def test_a_mistyped_name_starts_nobody(team: FakeTeam) -> None:
    result = cli("takeoff", "drone_9", "drone_2")
    assert result.returncode == 2 and "there is no drone drone_9" in result.stderr and not team.heard


def test_cutting_the_motors_asks(team: FakeTeam) -> None:
    assert cli("cut-motors", given="n\n").returncode == 130
    assert team.heard == []
    assert cli("cut-motors", "--yes").returncode == 0


def test_take_off_is_asked_of_the_operator_alone(team: FakeTeam) -> None:
    team.answers["drone_1"] = team.answers["drone_2"] = []
    team.buses["operator"] = open_bus(team.endpoint, "lab", "operator")
    team.answers["operator"] = FULL
    team.commands["operator"] = team.buses["operator"].subscribe([COMMAND])
    result = cli("takeoff", "--json")
    assert result.returncode == 0, result.stdout + result.stderr
    assert all(command.scope == ("operator",) for command in team.heard)


def test_a_start_from_another_host_is_stamped_by_the_clock_of_the_run(
    team: FakeTeam, monkeypatch: pytest.MonkeyPatch
) -> None:
    """By its own clock nobody could tell whether a stop came after it."""
    ahead_ns = 895 * 10**9
    team.buses["operator"] = operator = open_bus(team.endpoint, "lab", "operator")
    team.answers["operator"] = FULL
    team.commands["operator"] = operator.subscribe([COMMAND])
    (record,) = runtime_file.live_records()
    monkeypatch.setattr(stop, "choose_run", lambda _run, stops: structs.replace(record, host="laptop"))
    silent = threading.Event()

    def renew() -> None:
        while not silent.wait(0.1):
            header = Header(time.monotonic_ns() + ahead_ns, "run", "team", "operator", 0)
            operator.publish(LEASE, Lease(header=header, holder="operator", expires_ns=header.stamp_ns))

    renewing = threading.Thread(target=renew)
    renewing.start()
    given_ns = time.monotonic_ns() + ahead_ns
    try:
        assert stop.order(Verb.RESUME, (), None, as_json=True) == 0
    finally:
        silent.set()
        renewing.join()
    start = team.heard[-1]
    assert start.header.clock == "run" and start.expires_ns - start.header.stamp_ns == 5 * 10**9
    assert given_ns - 10**8 < start.header.stamp_ns < time.monotonic_ns() + ahead_ns


def test_a_start_from_another_host_is_not_sent_where_no_operator_is_heard(
    team: FakeTeam, monkeypatch: pytest.MonkeyPatch
) -> None:
    (record,) = runtime_file.live_records()
    monkeypatch.setattr(stop, "choose_run", lambda _run, stops: structs.replace(record, host="laptop"))
    monkeypatch.setattr(stop, "_CONNECT_S", 0.5)
    with pytest.raises(UnreachableError, match="not its operator"):
        stop.order(Verb.TAKEOFF, (), None, as_json=True)
    assert team.heard == []


def test_nothing_runs_and_the_folders_searched_are_named(alone: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (shared := alone / f"skein-{os.getuid()}").mkdir()
    with pytest.raises(UnreachableError, match=f"no ground station is running .* {alone}/skein, {shared}$"):
        stop.choose_run(None, stops=True)
    monkeypatch.setenv("XDG_RUNTIME_DIR", "")
    announce("tcp/127.0.0.1:9")
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(alone))
    assert stop.choose_run(None, stops=True).site == "lab"


def test_a_planted_folder_keeps_no_stop_from_the_others(alone: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    announce("tcp/127.0.0.1:9")
    monkeypatch.delenv("XDG_RUNTIME_DIR")
    (alone / f"skein-{os.getuid()}").symlink_to(alone)  # by another user, in /tmp
    assert stop.choose_run(None, stops=True).site == "lab"


def test_several_runs_must_be_told_apart(team: FakeTeam) -> None:
    announce(team.endpoint, site="hall")
    result = cli("land")
    assert result.returncode == 3 and f"--run hall-{os.getpid()}" in result.stderr
    assert cli("land", "--run", "lab").returncode == 0


def test_a_stop_means_the_real_drones_whatever_is_rehearsed_beside_them(team: FakeTeam) -> None:
    simulator = ProcessRecord("sim_bridge", "sim_bridge", os.getpid(), runtime_file.start_time(os.getpid()) or 0)
    announce("tcp/127.0.0.1:9", site="rehearsal", processes=(simulator,))
    assert cli("land").returncode == 0
    assert team.heard
    assert cli("takeoff").returncode == 3, "a start is never guessed"


@pytest.fixture
def elsewhere(alone: Path, monkeypatch: pytest.MonkeyPatch) -> RuntimeRecord:
    """A rehearsal on this host, and a run of a joined site, as another host finds it."""
    simulator = ProcessRecord("sim_bridge", "sim_bridge", os.getpid(), runtime_file.start_time(os.getpid()) or 0)
    announce("tcp/127.0.0.1:9", site="rehearsal", processes=(simulator,))
    nobody = ProcessRecord("supervisor", "supervisor", 0, 0)
    found = RuntimeRecord("arena", "", "tls/10.0.0.1:1", "r", "", ("drone_1",), nobody, (), host="laptop")
    monkeypatch.setattr(stop, "_elsewhere", lambda: [found])
    return found


def test_a_rehearsal_here_hides_no_real_drones_on_another_host_from_a_stop(elsewhere: RuntimeRecord) -> None:
    assert stop.choose_run(None, stops=True) == elsewhere
    assert stop.choose_run(None).site == "rehearsal", "a start goes to the nearest"


@pytest.mark.parametrize("stops", [True, False])
def test_a_run_on_another_host_can_be_named_beside_one_here(elsewhere: RuntimeRecord, stops: bool) -> None:
    assert stop.choose_run("arena", stops) == elsewhere
    assert stop.choose_run("rehearsal", stops).site == "rehearsal"


def test_the_site_of_a_rehearsal_names_the_real_run_of_that_site_to_a_stop(elsewhere: RuntimeRecord) -> None:
    runtime_file.write(structs.replace(runtime_file.live_records()[0], site="arena"))
    assert stop.choose_run("arena", stops=True) == elsewhere
    assert not stop.choose_run("arena").host and not stop.choose_run(f"arena-{os.getpid()}", stops=True).host


def test_a_rehearsal_is_stopped_where_nobody_else_flies(
    elsewhere: RuntimeRecord, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(stop, "_elsewhere", list)
    assert stop.choose_run(None, stops=True).site == "rehearsal"


def test_real_drones_here_are_stopped_without_a_search_elsewhere(alone: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    announce("tcp/127.0.0.1:9")
    monkeypatch.setattr(stop, "_elsewhere", lambda: pytest.fail("a search takes seconds"))
    assert stop.choose_run(None, stops=True).site == "lab"


def test_silent_router_signals_the_drivers_and_no_stranger(runtime: Path) -> None:
    with subprocess.Popen(["sleep", "30"]) as driver, subprocess.Popen(["sleep", "30"]) as stranger:
        started = runtime_file.start_time(driver.pid) or 0
        other = runtime_file.start_time(stranger.pid) or 0
        processes = (
            ProcessRecord("drone_1", "driver", driver.pid, started),
            ProcessRecord("drone_2", "driver", stranger.pid, other - 1),
        )
        announce("tcp/127.0.0.1:9", processes=processes)
        result = cli("land")
        assert result.returncode == 4
        assert "no router answers" in result.stdout and "ordered drone_1 to land" in result.stdout
        assert driver.wait(5) == -signal.SIGTERM
        assert stranger.poll() is None
        stranger.kill()


def test_a_driver_that_has_just_ended_keeps_no_other_from_its_signal(monkeypatch: pytest.MonkeyPatch) -> None:
    own = runtime_file.start_time(os.getpid()) or 0
    drivers = tuple(ProcessRecord(name, "driver", os.getpid(), own) for name in ("drone_1", "drone_2"))
    signalled: list[int] = []

    def kill(pid: int, _number: int) -> None:
        signalled.append(pid)
        if len(signalled) == 1:
            raise ProcessLookupError

    monkeypatch.setattr("groundstation.cli.stop.os.kill", kill)
    record = RuntimeRecord("lab", "", "", "", "", (), drivers[0], drivers)
    assert stop.signal_drivers(record) == ["drone_2"] and len(signalled) == 2


def test_stop_verbs_import_nothing_heavy(alone: Path) -> None:
    heavy = ("cryptography", "numpy", "cv2", "pydantic", "rich", "ruamel", "scipy", "numba")
    script = "import sys, groundstation.cli.stop, groundstation.cli.main; groundstation.cli.stop._elsewhere();"
    script += f"print([m for m in {heavy} if m in sys.modules])"
    result = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert result.stdout.strip() == "[]"
