"""Kernels are compiled before anything starts; a failed, hanging or cancelled compilation leaves nothing behind."""

import sys
import time
from collections.abc import Callable
from pathlib import Path

import pytest
from dummy_table import spec, start

from groundstation.errors import GroundStationError
from groundstation.supervisor import kernels
from groundstation.supervisor.runtime_file import start_time
from groundstation.supervisor.start import Interrupted
from groundstation.supervisor.supervisor import Supervisor


def _command(body: str) -> tuple[str, ...]:
    return sys.executable, "-c", body


def test_it_ends_when_all_are_compiled_and_tells_the_operator() -> None:
    said: list[str] = []
    assert kernels.compile_first(said.append, lambda: False, _command("pass"))
    assert said == ["  compiling kernels: once per version, a minute or two"]


def test_a_failure_is_told_by_its_last_line() -> None:
    with pytest.raises(GroundStationError, match=r"kernels cannot be compiled: RuntimeError: no space"):
        kernels.compile_first(lambda _: None, lambda: False, _command("raise RuntimeError('no space')"))


def test_kernels_are_not_compiled_without_a_usable_cache(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "file" / "kernels"))
    said: list[str] = []
    with pytest.raises(GroundStationError, match=r"file/kernels \(Not a directory\): let NUMBA_CACHE_DIR name"):
        kernels.compile_first(said.append, lambda: False, _command("pass"))
    assert said == []


@pytest.mark.parametrize("late", [True, False])
def test_a_late_or_cancelled_compilation_ends_with_its_children(tmp_path: Path, late: bool) -> None:
    mark = tmp_path / "child"
    child = f"open({str(mark)!r}, 'w').write(str(__import__('os').getpid())); __import__('time').sleep(60)"
    command = _command(f"import subprocess, sys; subprocess.run([sys.executable, '-c', {child!r}])")
    if late:
        with pytest.raises(GroundStationError, match="not compiled after 1 s"):
            kernels.compile_first(lambda _: None, lambda: False, command, limit_s=1.0)
    else:
        assert not kernels.compile_first(lambda _: None, lambda: mark.exists() and bool(mark.read_text()), command)
    if mark.exists() and mark.read_text():
        _gone(int(mark.read_text()))


def _gone(pid: int) -> None:
    deadline = time.monotonic() + 5.0
    while start_time(pid) is not None:
        assert time.monotonic() < deadline, f"{pid} still runs"
        time.sleep(0.05)


@pytest.mark.parametrize(("needed", "compiled", "times"), [(False, False, 0), (True, True, 0), (True, False, 1)])
def test_a_start_compiles_only_what_lacks_and_only_for_who_needs_it(
    make: Callable[..., Supervisor], monkeypatch: pytest.MonkeyPatch, needed: bool, compiled: bool, times: int
) -> None:
    asked: list[str] = []

    def compile_first(*_: object) -> bool:
        asked.append("compile")
        return True

    monkeypatch.setattr(kernels, "compile_first", compile_first)
    monkeypatch.setattr(kernels, "are_compiled", lambda: compiled)
    start(make(spec("tracker", "obedient", kernels=needed)))
    assert len(asked) == times


def test_a_stop_meanwhile_starts_nothing(make: Callable[..., Supervisor], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(kernels, "are_compiled", lambda: False)
    monkeypatch.setattr(kernels, "compile_first", lambda *_: False)
    supervisor = make(spec("tracker", "obedient", kernels=True))
    with pytest.raises(Interrupted):
        start(supervisor)
    assert not any(process.running for process in supervisor.processes)
