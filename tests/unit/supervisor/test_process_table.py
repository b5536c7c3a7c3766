"""The rows of the process table: each can be started, and none occurs twice."""

import ast
from importlib.util import find_spec
from pathlib import Path

import pytest

from groundstation.supervisor.process_spec import ProcessSpec
from groundstation.supervisor.process_table import ROWS


@pytest.mark.parametrize("row", [row for row in ROWS if row.entry], ids=lambda row: row.role)
def test_an_entry_names_a_function_of_one_child(row: ProcessSpec) -> None:
    module, _, function = row.entry.partition(":")
    found = find_spec(module)
    assert found is not None and found.origin is not None, module
    functions = [n for n in ast.parse(Path(found.origin).read_text()).body if isinstance(n, ast.FunctionDef)]
    assert [len(one.args.args) for one in functions if one.name == function] == [1], row.entry


def test_each_role_has_one_row_that_is_killed_only_after_its_silence_was_noticed() -> None:
    assert len({row.role for row in ROWS}) == len(ROWS)
    for row in ROWS:
        assert row.silence_limit_s <= row.hang_limit_s < row.start_limit_s, row.role


def test_processes_that_a_flight_waits_for_have_higher_priority() -> None:
    shares = {row.role: row.nice for row in ROWS}
    assert shares["router"] == shares["tracker"] == shares["driver"] < shares["camera"] < shares["monitor"]
    assert shares["console"] == shares["camera"] == shares["recorder"] == 0, "that of any other program"
