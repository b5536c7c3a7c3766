"""Commands that compile kernels keep them: numba reads where to when it is imported, and never again."""

import subprocess
import sys

import click
import pytest

from groundstation.cli.bench_planner import choices, numbers

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


def test_what_is_named_twice_is_computed_once() -> None:
    assert choices("paper, certified,paper", ("paper", "certified"), "--strategies") == ["paper", "certified"]
    assert numbers("2,5,2", "--robots", 1, 100) == [2, 5]


def test_a_list_of_nothing_is_refused() -> None:
    with pytest.raises(click.UsageError, match="at least one of"):
        choices(" ,", ("paper",), "--strategies")
