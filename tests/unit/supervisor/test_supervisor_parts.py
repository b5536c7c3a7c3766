"""Runtime file, terminal, interrupts, failsafe datagrams: each alone."""

import os
import select
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import msgspec
import pytest
from msgspec import structs

from groundstation.errors import GroundStationError
from groundstation.supervisor import runtime_file
from groundstation.supervisor.failsafe_sender import FailsafeSender
from groundstation.supervisor.interrupts import _UNHEEDED, _WISHES, Interrupts, put_aside_by_nobody
from groundstation.supervisor.process_spec import FailsafeDatagrams
from groundstation.supervisor.runtime_file import ProcessRecord, RuntimeRecord
from groundstation.supervisor.terminal import Terminal

S = 1_000_000_000


@pytest.fixture
def runtime(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    return tmp_path / "skein"


def record(pid: int, started: int, heartbeat: str = "") -> RuntimeRecord:
    supervisor = ProcessRecord("supervisor", "supervisor", pid, started)
    return RuntimeRecord("lab", "lab.yaml", "tcp/127.0.0.1:1", "runs/x", heartbeat, ("drone_1",), supervisor, ())


def test_live_run_is_found(runtime: Path) -> None:
    started = runtime_file.start_time(os.getpid())
    assert started is not None
    path = runtime_file.write(record(os.getpid(), started))
    assert path.stat().st_mode & 0o77 == 0
    assert [r.name for r in runtime_file.live_records()] == [f"lab-{os.getpid()}"]


def test_pid_of_a_stranger_does_not_count(runtime: Path, tmp_path: Path) -> None:
    block = tmp_path / "skein-lab-1"
    block.write_bytes(b"")
    started = runtime_file.start_time(os.getpid()) or 0
    path = runtime_file.write(record(os.getpid(), started - 1, str(block)))
    assert runtime_file.live_records() == []
    assert not path.exists() and not block.exists()


def test_only_our_own_kind_of_file_is_removed_with_a_stale_record(runtime: Path, tmp_path: Path) -> None:
    precious = tmp_path / "precious"
    precious.write_bytes(b"")
    runtime_file.write(record(2**22 - 1, 1, str(precious)))
    assert runtime_file.live_records() == []
    assert precious.exists()


@pytest.mark.parametrize("content", [b"", b"{", b"[]", b'{"site": 3}'])
def test_damaged_runtime_file_is_removed(runtime: Path, content: bytes) -> None:
    path = runtime_file.folder() / "lab-1.json"
    path.write_bytes(content)
    assert runtime_file.live_records() == []
    assert not path.exists()


def test_the_file_of_another_version_stays_while_its_run_lives(runtime: Path) -> None:
    path = runtime_file.folder() / "lab-1.json"
    own = {
        "name": "supervisor",
        "role": "supervisor",
        "pid": os.getpid(),
        "start_time": runtime_file.start_time(os.getpid()),
    }
    path.write_bytes(msgspec.json.encode({"supervisor": own, "field": 3}))
    assert runtime_file.live_records() == []
    assert path.exists()
    path.write_bytes(msgspec.json.encode({"supervisor": own | {"start_time": 1}, "field": 3}))
    assert runtime_file.live_records() == []
    assert not path.exists()


def test_a_folder_that_is_gone_is_an_os_error_to_who_writes_and_nothing_to_who_removes(
    runtime: Path, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    one = record(os.getpid(), runtime_file.start_time(os.getpid()) or 0, str(tmp_path / "block"))
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path / "gone"))
    monkeypatch.setattr(runtime_file, "_SHARED", tmp_path / "gone")
    with pytest.raises(OSError, match="gone"):
        runtime_file.write(one)
    runtime_file.remove(one)


def test_shells_with_other_folders_for_temporary_files_find_the_same_run(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """As with a full /tmp, where Python chooses /var/tmp by itself."""
    monkeypatch.delenv("XDG_RUNTIME_DIR", raising=False)
    found = set()
    for name in ("one", "other"):
        (tmp_path / name).mkdir()
        monkeypatch.setenv("TMPDIR", str(tmp_path / name))
        monkeypatch.setattr("tempfile.tempdir", None)
        found.add(runtime_file.folder())
    assert found == {Path(f"/tmp/skein-{os.getuid()}")}


def test_a_run_is_found_from_a_shell_with_another_runtime_folder(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """As from a desktop's terminal, a cron job, a session that is not a login, or beside the service."""
    for name, place in (("_SESSIONS", "user"), ("_SERVICE", "service"), ("_SHARED", "tmp")):
        (tmp_path / place).mkdir()
        monkeypatch.setattr(runtime_file, name, tmp_path / place)
    session = tmp_path / "user" / str(os.getuid())
    session.mkdir()
    one = record(os.getpid(), runtime_file.start_time(os.getpid()) or 0)
    homes = (str(session), str(tmp_path / "service"), "")
    for home in homes:
        monkeypatch.setenv("XDG_RUNTIME_DIR", home)
        assert runtime_file.live_records() == [] == runtime_file.records_beside()
        runtime_file.write(one)
        for other in {*homes, str(tmp_path)} - {home}:
            monkeypatch.setenv("XDG_RUNTIME_DIR", other)
            assert runtime_file.live_records() == []
            assert runtime_file.records_beside() == [one]
        monkeypatch.setenv("XDG_RUNTIME_DIR", home)
        runtime_file.remove(one)


def test_a_stale_record_of_another_folder_is_removed_there(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(runtime_file, "_SHARED", tmp_path)
    monkeypatch.setenv("XDG_RUNTIME_DIR", "")
    path = runtime_file.write(record(2**22 - 1, 1))
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    assert runtime_file.records_beside() == [] and not path.exists()


def test_a_planted_folder_of_records_is_not_read(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(runtime_file, "_SHARED", tmp_path)
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    (tmp_path / f"skein-{os.getuid()}").symlink_to(runtime_file.folder().rename(tmp_path / "planted"))
    assert runtime_file.folders_beside() == []


def test_keys_of_a_run_that_died_before_it_was_recorded_are_removed(runtime: Path) -> None:
    own = f"lab-{os.getpid()}"  # about to be recorded
    for name in ("lab-4194303", "hall_2-4194302", own, "lab", "lab-4194303-x"):
        (runtime_file.folder() / name).mkdir()
        (runtime_file.folder() / name / "drone_1.key").touch()
    (runtime / "lab-4194301").touch()
    assert runtime_file.live_records() == []
    assert {path.name for path in runtime.iterdir()} == {own, "lab", "lab-4194303-x", "lab-4194301"}


def test_keys_of_drivers_that_outlive_their_supervisor_stay(runtime: Path) -> None:
    own = ProcessRecord("drone_1", "driver", os.getpid(), runtime_file.start_time(os.getpid()) or 0)
    runtime_file.write(structs.replace(record(2**22 - 1, 1), processes=(own,)))
    (runtime / f"lab-{2**22 - 1}").mkdir()
    assert len(runtime_file.live_records()) == 1 and (runtime / f"lab-{2**22 - 1}").exists()


def test_zombie_is_not_alive() -> None:
    with subprocess.Popen([sys.executable, "-c", ""]) as process:
        os.waitid(os.P_PID, process.pid, os.WEXITED | os.WNOWAIT)
        assert runtime_file.start_time(process.pid) is None


def test_folder_of_someone_else_is_refused(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    (tmp_path / "elsewhere").mkdir()
    (tmp_path / "skein").symlink_to(tmp_path / "elsewhere")
    with pytest.raises(GroundStationError, match="not a folder of yours"):
        runtime_file.folder()


def test_closed_terminal_is_survived() -> None:
    read, write = os.pipe()
    terminal = Terminal(write)
    os.close(read)
    for _ in range(5):
        terminal.say("is anyone there?")
    terminal.flush()
    terminal.say("still here")
    terminal.flush()
    os.close(write)


def test_stopped_terminal_blocks_nobody() -> None:
    read, write = os.pipe()
    terminal = Terminal(write)
    for _ in range(3000):
        terminal.say("x" * 100)
    terminal.flush(0.05)
    os.close(read)
    terminal.flush()
    os.close(write)


def test_a_line_moves_no_cursor_and_colours_nothing() -> None:
    read, write = os.pipe()
    terminal = Terminal(write)
    terminal.say("LAND by \x1b[2Jcli\r\x9b1m\x07\x7f\nµ")
    terminal.flush()
    assert os.read(read, 100).decode() == "LAND by �[2Jcli��1m��\nµ\n"
    os.close(read)
    os.close(write)


def test_muted_lines_come_later() -> None:
    read, write = os.pipe()
    terminal = Terminal(write)
    terminal.muted = True
    terminal.say("meanwhile")
    terminal.unmute()
    terminal.say("now")
    terminal.flush()
    assert os.read(read, 100) == b"meanwhile\nnow\n"
    os.close(read)
    os.close(write)


@pytest.fixture
def interrupts() -> Iterator[Interrupts]:
    kept = {n: signal.getsignal(n) for n in (*_WISHES, *_UNHEEDED, signal.SIGTSTP)}
    made = Interrupts()
    made.install()
    yield made
    made.close()
    for number, handler in kept.items():
        signal.signal(number, handler)


def test_first_wish_lands_second_hurries(interrupts: Interrupts) -> None:
    os.kill(os.getpid(), signal.SIGINT)
    assert interrupts.stop_requested and not interrupts.hurry
    os.kill(os.getpid(), signal.SIGTERM)
    assert not interrupts.hurry, "the same wish, said twice at once"
    time.sleep(0.6)
    os.kill(os.getpid(), signal.SIGINT)
    assert interrupts.hurry


def test_no_key_of_the_terminal_stops_or_kills_who_watches_over_drones(interrupts: Interrupts) -> None:
    for number in (signal.SIGTTIN, signal.SIGTTOU):
        assert signal.getsignal(number) is signal.SIG_IGN
        os.kill(os.getpid(), number)
    assert not interrupts.clear()
    os.kill(os.getpid(), signal.SIGTSTP)
    assert select.select([interrupts.descriptor], [], [], 5.0)[0], "it is told of at once"
    assert "Ctrl-C lands all drones" in interrupts.clear()
    assert not interrupts.clear(), "each press is told of once"
    assert not interrupts.stop_requested
    os.kill(os.getpid(), signal.SIGQUIT)
    assert interrupts.stop_requested


def test_a_process_inherits_that_nobody_puts_it_aside(interrupts: Interrupts) -> None:
    script = "import signal; print(signal.getsignal(signal.SIGTSTP) is signal.SIG_IGN)"
    with put_aside_by_nobody():
        said = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert said.stdout.strip() == "True"
    assert callable(signal.getsignal(signal.SIGTSTP)), "this process answers again"


def test_closing_terminal_never_hurries(interrupts: Interrupts) -> None:
    os.kill(os.getpid(), signal.SIGHUP)
    time.sleep(0.6)
    os.kill(os.getpid(), signal.SIGHUP)
    assert interrupts.stop_requested and not interrupts.hurry


def test_last_words_repeat_and_then_land() -> None:
    sender = FailsafeSender()
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as drone:
        drone.bind(("127.0.0.1", 0))
        drone.settimeout(2)
        words = FailsafeDatagrams("127.0.0.1", drone.getsockname()[1], b"hover", b"land", land_after_s=3.0)
        assert sender.begin("drone_1", words, 0)
        assert not sender.begin("drone_1", words, 10)
        sent = {}
        for ms in range(0, 4000, 50):
            sender.send_due(ms * 1_000_000)
            drone.setblocking(False)
            try:
                sent[ms] = drone.recv(100)
            except BlockingIOError:
                continue
        assert sorted(sent) == list(range(0, 4000, 100))
        assert {sent[ms] for ms in range(0, 3000, 100)} == {b"hover"}
        assert {sent[ms] for ms in range(3000, 4000, 100)} == {b"land"}
        assert sender.end("drone_1") and not sender.end("drone_1")
    sender.close()


def test_land_comes_earlier_once_its_time_is_set_earlier() -> None:
    """As when the frozen supervisor is killed: nobody can take over again, and hovering on has no purpose."""
    sender = FailsafeSender()
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as drone:
        drone.bind(("127.0.0.1", 0))
        drone.settimeout(2)
        words = FailsafeDatagrams("127.0.0.1", drone.getsockname()[1], b"hover", b"land", land_after_s=3.0)
        for since_s, now_s, sent in ((4, 5.0, b"hover"), (4, 5.2, b"hover"), (2, 5.4, b"land"), (4, 5.6, b"land")):
            sender.begin("drone_1", words, since_s * S)
            sender.send_due(round(now_s * S))
            assert drone.recv(100) == sent
    sender.close()
