"""One damaged list of entry points, of any installed package, stops only what needs a plug-in."""

from pathlib import Path

import pytest
from installation import install

from drivers.camera.source_address import parse_source
from drivers.motion_capture.settings import parse_source as parse_system
from groundstation import plug_ins
from groundstation.cli import main as cli
from groundstation.cli.exits import ExitCode
from groundstation.doctor.plug_ins import plug_in_findings
from groundstation.geometry.tag import tag_fault
from groundstation.vehicles import registry

LAB = str(Path(__file__).parents[3] / "config/lab.yaml")
TOLD = "; lab-damaged: entry_points.txt is damaged: mend or uninstall that package"


@pytest.fixture(autouse=True)
def _damaged(tmp_path, monkeypatch):
    install(tmp_path, "lab-damaged", "[skein.planners]\nthis line has no sign of equality\n")
    install(tmp_path, "lab-good", "[skein.planners]\ncalm = fractions:Fraction\n")
    monkeypatch.syspath_prepend(tmp_path)
    registry._found.cache_clear()
    yield
    registry._found.cache_clear()


def test_a_field_without_plug_ins_is_good(capsys):
    assert cli.run(["config", "check", LAB]) == ExitCode.OK
    assert "damaged" not in capsys.readouterr().err


def test_plug_ins_of_other_packages_are_found():
    assert "calm" in plug_ins.names(plug_ins.PLANNERS)


@pytest.mark.parametrize("option", ["planner.plug_in=hasty", "drones.drone_1.kind=zeppelin"])
def test_a_field_that_asks_for_one_is_told_the_package(capsys, option):
    assert cli.run(["config", "check", LAB, "--set", option]) == ExitCode.SETTINGS
    assert TOLD in capsys.readouterr().err


def test_whatever_else_asks_for_one_is_told_the_package():
    for parse in (parse_source, parse_system):
        with pytest.raises(ValueError, match=TOLD):
            parse("unheard://a")
    assert tag_fault("unheard", 1).endswith(TOLD)
    with pytest.raises(plug_ins.PlugInError, match=TOLD):
        plug_ins.load(plug_ins.CAMERAS, "unheard")
    assert [one.found for one in plug_in_findings() if one.subject == "plug-ins"] == [TOLD.removeprefix("; ")]


def test_without_damage_nothing_is_told(monkeypatch):
    monkeypatch.undo()
    assert plug_ins.damage() == ""
