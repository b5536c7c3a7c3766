"""The study's command line answers an operator's mistake in one line, without a traceback."""

import sys

import msgspec
import pytest
from installation import install

from groundstation.field.resolved import ResolvedField
from sim_bridge.study.__main__ import main


@pytest.mark.parametrize(("text", "said"), [(None, "no such file"), ("windy: 1", "windy")])
def test_a_wrong_scenario_is_named(tmp_path, monkeypatch, capsys, text, said):
    path = tmp_path / "scenario.yaml"
    if text is not None:
        path.write_text(text)
    monkeypatch.setattr("sim_bridge.study.__main__.resolved_field", lambda *_: None)
    monkeypatch.setattr(sys, "argv", ["study", "demo", "--scenario", str(path)])
    assert main() == 2
    assert said in capsys.readouterr().err


@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        ("--duration=nan", "nan must be from 1 to 3600"),
        ("--duration=inf", "inf must be from 1 to 3600"),
        ("--duration=-3", "-3 must be from 1 to 3600"),
        ("--duration=long", "invalid number value: 'long'"),
        ("--seed=-1", "-1 must be 0 or more"),
        ("--seeds=0", "0 must be from 1 to 1000"),
        ("--outliers=3", "3 must be from 0 to 1"),
        ("--start-phase=nan", "nan must be from 0 to 1"),
    ],
)
def test_a_figure_out_of_its_range_is_named(monkeypatch, capsys, wrong, said):
    monkeypatch.setattr(sys, "argv", ["study", "demo", wrong])
    with pytest.raises(SystemExit) as ended:
        main()
    assert ended.value.code == 2
    assert f"argument {wrong.partition('=')[0]}: {said}" in capsys.readouterr().err


def test_a_start_on_a_path_without_phases_is_refused(tmp_path, monkeypatch, capsys):
    (tmp_path / "still.yaml").write_text("target: {path: {shape: none}}")
    monkeypatch.setattr("sim_bridge.study.__main__.resolved_field", lambda *_: None)
    monkeypatch.setattr(sys, "argv", ["study", "demo", "--scenario", f"{tmp_path}/still.yaml", "--start-phase", "0.5"])
    with pytest.raises(SystemExit) as ended:
        main()
    assert ended.value.code == 2
    assert "--start-phase: the target's path is none" in capsys.readouterr().err


PLANNERS = "".join(f"{name} = lab_planner:{name.title()}\n" for name in ("clumsy", "leaving", "sulking"))


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("clumsy", "planner.plug_in clumsy: ZeroDivisionError: division by zero\n"),
        ("leaving", "planner.plug_in leaving: SystemExit: bye\n"),
        ("sulking", "planner.plug_in: sulking cannot be used: lab-planner (lab_planner:Sulking): ValueError: no\n"),
    ],
)
def test_a_planner_of_another_package_that_fails_is_named(
    tmp_path, monkeypatch, capsys, lab_field: ResolvedField, name, said
):
    (tmp_path / "lab_planner.py").write_text(
        "class Clumsy:\n    def __init__(self, *made_from): ...\n    def plan(self, *asked): return 1 / 0\n"
        "class Leaving(Clumsy):\n    def plan(self, *asked): raise SystemExit('bye')\n"
        "class Sulking(Clumsy):\n    def __init__(self, *made_from): raise ValueError('no')\n"
    )
    install(tmp_path, "lab-planner", f"[skein.planners]\n{PLANNERS}")
    monkeypatch.syspath_prepend(tmp_path)
    field = msgspec.structs.replace(lab_field, planner=msgspec.structs.replace(lab_field.planner, plug_in=name))
    monkeypatch.setattr("sim_bridge.study.__main__.resolved_field", lambda *_: field)
    monkeypatch.setattr(sys, "argv", ["study", "demo", "--duration", "1"])
    assert main() == 2
    assert capsys.readouterr().err == said
    sys.modules.pop("lab_planner", None)
