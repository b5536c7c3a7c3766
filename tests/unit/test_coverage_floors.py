"""The coverage measurement: what is counted, what counts as run, and failure below the floor."""

import ast
import json
import sys
from pathlib import Path
from typing import Any

import pytest

import floors
from block_probes import HITS, put_probes
from floors import Count, counts, faults, main, package_of, raised
from measurement import VARIABLE, Measured, Measurement

SOURCE = '''
def sign(x):
    """Docstrings are not counted."""
    y = 0
    if x > 0:
        y = 1
    elif x < 0:
        return -1
    for _ in range(y):
        y = y
    try:
        y = 1 // x
    except ZeroDivisionError:
        y = 0
    else:
        y = 1
    return y

@kernel()
def compiled(x):
    return x
'''


def probed(*calls: int) -> tuple[list[int], bytes]:
    tree = ast.parse(SOURCE)
    statements = put_probes(tree).statements
    names: dict[str, Any] = {HITS: bytearray(len(statements)), "kernel": lambda: lambda function: function}
    exec(compile(tree, "source", "exec"), names)
    for x in calls:
        assert names["sign"](x) == (x > 0) - (x < 0)
    return statements, bytes(names[HITS])


def test_each_statement_outside_kernels_is_counted_once():
    statements, hits = probed()
    assert sum(statements) == 12 and not any(hits)


def test_functions_that_write_instructions_are_not_counted():
    """They run where a kernel is compiled: in the run of tests, or earlier and in another process."""
    assert put_probes(ast.parse(f"from llvmlite import ir\n{SOURCE}")).statements == []
    assert put_probes(ast.parse("@in_lanes\ndef write(b):\n    b.add(1, 2)")).statements == []


@pytest.mark.parametrize(("calls", "expected"), [((1,), 9), ((-1,), 4), ((0,), 8), ((1, 0, -1), 12)])
def test_executed_statements_are_counted(calls, expected):
    statements, hits = probed(*calls)
    assert sum(n for n, hit in zip(statements, hits, strict=True) if hit) == expected


def test_modules_that_nobody_imports_count_as_not_run(tmp_path):
    module = tmp_path / "drivers" / "kind" / "part.py"
    module.parent.mkdir(parents=True)
    module.write_text(SOURCE, encoding="utf-8")
    _, hits = probed(1)
    assert counts(tmp_path, Measured({})) == {"drivers.kind": Count(0, 12)}
    assert counts(tmp_path, Measured({str(module): hits})) == {"drivers.kind": Count(9, 12)}
    assert counts(tmp_path, Measured({str(module): hits[1:]})) == {"drivers.kind": Count(0, 12)}
    assert package_of(Path("drivers/base.py")) == "drivers"


def test_a_package_below_its_floor_is_a_fault():
    assert faults({"drivers": Count(9, 12)}, {"drivers": 75}) == []
    (low,) = faults({"drivers": Count(8, 12)}, {"drivers": 75})
    assert "66.7 %" in low and "75 %" in low


def test_packages_and_floors_name_each_other():
    (new,) = faults({"drivers": Count(9, 12)}, {})
    assert "no floor" in new and "72" in new
    (gone,) = faults({}, {"drivers": 75})
    assert "gone" in gone


def test_floors_are_only_raised():
    found = {"a": Count(90, 100), "b": Count(50, 100)}
    assert raised(found, {"a": 80, "b": 60}) == {"a": 87, "b": 60}


def test_a_repetition_adds_to_what_ran_before():
    first = Measured({"a": b"\1\0", "b": b"\1"}, 3)
    added = first.with_repeated(Measured({"a": b"\0\1", "b": b"\0\0", "c": b"\1"}))
    assert added == Measured({"a": b"\1\1", "b": b"\0\0", "c": b"\1"}, 3)


def test_statements_run_in_any_process_count():
    parts = [Measured({"a": b"\1\0", "b": b"\1"}, 3), Measured({"a": b"\0\1", "c": b"\0"}, 1)]
    assert Measured.joined(parts) == Measured({"a": b"\1\1", "b": b"\1", "c": b"\0"}, 4)


def test_a_run_writes_what_it_measured(tmp_path, monkeypatch):
    monkeypatch.setattr(sys, "meta_path", [*sys.meta_path])
    path = tmp_path / "new" / "data.json"
    monkeypatch.setenv(VARIABLE, str(path))
    measurement = Measurement()
    measurement.finish(2, repeated=False)
    assert Measured.read(path) == Measured({}, 2)
    Measured({"a": b"\1"}, 1).write(path)
    measurement.finish(0, repeated=True)
    assert Measured.read(path) == Measured({"a": b"\1"}, 1)


def test_the_command_fails_below_a_floor(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(floors, "ROOT", tmp_path)
    monkeypatch.setattr(floors, "FLOORS", tmp_path / "floors.toml")
    (tmp_path / "floors.toml").write_text("drivers = 1", encoding="utf-8")
    (tmp_path / "drivers").mkdir()
    (tmp_path / "drivers" / "part.py").write_text(SOURCE, encoding="utf-8")
    data = tmp_path / "data.json"
    Measured({}, 1).write(data)
    whole = tmp_path / "whole.json"
    Measured({str(tmp_path / "drivers" / "part.py"): probed(1)[1]}).write(whole)
    monkeypatch.setenv("CI", "true")
    assert main([str(data), str(whole)]) == 0
    capsys.readouterr()
    assert main([str(data)]) == 1
    assert "drivers: 0.0 %" in capsys.readouterr().out
    monkeypatch.delenv("CI")
    assert main([str(data)]) == 0
    assert "not judged" in capsys.readouterr().out
    assert json.loads(data.read_text(encoding="utf-8"))["skipped"] == 1
