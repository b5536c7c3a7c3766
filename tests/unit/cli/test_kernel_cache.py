"""Commands that compile kernels set the cache folder before numba is imported, which reads it only then."""

import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import click
import pytest
from installation import install

from groundstation.cli import kernels
from groundstation.cli.lists import choices, numbers
from groundstation.cli.recorded_flight import recorded_flight
from groundstation.errors import GroundStationError
from groundstation.process import numba_cache
from groundstation.runtime import compile_kernels

ROOT = Path(__file__).parents[3]
_SCRIPT = """
import sys
from groundstation.process import numba_cache

def activate(*_):
    print("numba" in sys.modules)
    raise SystemExit

numba_cache.activate = activate
from groundstation.cli.main import run
run(sys.argv[1:])
"""


@pytest.mark.parametrize("command", ["figure1", "teams", "figure-eight", "sensors", "sweep"])
def test_the_place_of_compiled_kernels_is_set_before_numba_is_there(command: str) -> None:
    script = [sys.executable, "-c", _SCRIPT, "experiment", command]
    assert subprocess.run(script, capture_output=True, text=True, check=True).stdout.split() == ["False"]


def test_a_planner_of_another_package_finds_compiled_kernels(tmp_path: Path) -> None:
    """Every command that reads a field with such a planner compiled for 70 s."""
    (tmp_path / "lab_planner.py").write_text(
        "import sys\nfrom numba import config\n\n\n"
        "class Calm:\n    def __init__(self, *made_from): ...\n    def plan(self, *asked): ...\n\n\n"
        "print(f'kept in {config.CACHE_DIR}', file=sys.stderr)\n"
    )
    install(tmp_path, "lab-planner", "[skein.planners]\ncalm = lab_planner:Calm\n")
    chosen = os.environ | {"PYTHONPATH": f"{tmp_path}:{ROOT}", "XDG_CACHE_HOME": str(tmp_path)}
    del chosen["NUMBA_CACHE_DIR"]
    command = [sys.executable, "-m", "groundstation", "config", "check", "lab", "--set", "planner.plug_in=calm"]
    told = subprocess.run(command, capture_output=True, text=True, check=True, env=chosen, cwd=tmp_path).stderr
    assert f"kept in {tmp_path}/skein/numba-{numba_cache.sources_hash()}\n" in told


@pytest.mark.parametrize("use", [kernels.use_flying_kernels, kernels.use_all_kernels])
def test_where_nothing_can_be_kept_is_told_at_once(
    use: Callable[[], None], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A re-run compiled for minutes at each call, without a message."""
    (tmp_path / "taken").write_text("")
    monkeypatch.setattr(numba_cache, "activate", lambda *_: tmp_path / "taken" / "cache")
    with pytest.raises(GroundStationError, match="let NUMBA_CACHE_DIR name a folder"):
        use()


def test_compiling_is_told_and_done_once(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(numba_cache, "activate", lambda *_: tmp_path)
    monkeypatch.setattr(compile_kernels, "compile_kernels", numba_cache.mark_complete)
    kernels.use_flying_kernels()
    assert "compiling kernels" in capsys.readouterr().err
    kernels.use_flying_kernels()
    assert not capsys.readouterr().err


def test_options_named_twice_are_used_once() -> None:
    assert choices("paper, certified,paper", ("paper", "certified"), "--strategies") == ["paper", "certified"]
    assert numbers("2,5,2", "--robots", 1, 100) == [2, 5]


def test_a_list_of_nothing_is_refused() -> None:
    with pytest.raises(click.UsageError, match="at least one of"):
        choices(" ,", ("paper",), "--strategies")


def test_files_that_are_no_recording_are_refused_before_kernels_compile(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(kernels, "use_flying_kernels", lambda: pytest.fail("compiled for nothing"))
    (tmp_path / "flight.mcap").write_bytes(b"another program's")
    with pytest.raises(click.UsageError, match="not an MCAP recording"):
        recorded_flight((tmp_path / "flight.mcap",))
