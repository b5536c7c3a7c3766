"""Planners and camera sources of other packages: found by name, used, and named when loading fails."""

import re
import sys
from inspect import signature
from pathlib import Path
from unittest.mock import Mock

import numpy as np
import pytest
from installation import install

from drivers.camera.source_address import SourceKind, parse_source
from drivers.camera.sources.opening import open_source
from drivers.motion_capture.settings import SystemAddress
from drivers.motion_capture.sources import open_source as open_system
from groundstation import plug_ins
from groundstation.bus.memory_bus import MemoryBus, MemoryExchange
from groundstation.doctor.plug_ins import plug_in_findings
from groundstation.errors import DriverError, SettingsError
from groundstation.flight.composition import process_table
from groundstation.geometry.tag import tag_fault
from groundstation.library import Topology, belief_of, field_named, plan_step, planner_of
from groundstation.planning.planner import Planner
from groundstation.runtime.tracker_loop import TrackerFeed, TrackerSection, Tracking
from groundstation.settings.load import load_field

FIXTURE = Path(__file__).parents[2] / "fixtures" / "field" / "lab.yaml"

CODE = '''
from collections import Counter

import numpy as np

from drivers.camera.sources.frames import Matrix, Unit
from drivers.camera.sources.raw import Decoded
from groundstation.planning.planner import Planner


class Calm(Planner):
    """Plans as ours does, and says who it is."""


class Static:
    decoder = Decoded()

    def __init__(self, source, size):
        self.name, self.rejected = source, Counter()

    def read(self, drain):
        drain.opened()
        while not drain.wait(0.01):
            drain.keep([Unit(b"", 1, 1, picture=Matrix(np.full((4, 6), 7, np.uint8)))])

    def interrupt(self):
        pass


class Idle:
    def __init__(self, *made_from):
        pass


class Sulking:
    def __init__(self, *made_from):
        raise RuntimeError("no licence")

    def plan(self, *asked):
        pass


class Stumbling(Static):
    def read(self, drain):
        raise ValueError("no picture of mine")


class Fixed(Idle):
    plan = 3


class Alone:
    def __init__(self):
        pass

    def plan(self, belief, current, warm_start, should_stop, max_evaluations=None):
        pass


class Short(Idle):
    def plan(self, belief):
        pass


class Holding(Alone, Idle):
    takes_held = True
    __init__ = Idle.__init__


def hired(parameters, sensors):
    return Short()


FIGURE = 3
'''
UNFIT = {
    "idle": "Idle without plan",
    "fixed": "Fixed.plan is of type int, nothing that can be called",
    "alone": r"Alone is made with \(parameters, sensors\): too many positional arguments",
    "short": r"Short.plan is called with \(belief, current, .*\): too many positional arguments",
    "holding": r"Holding.plan is called with \(belief, .*, held=...\): got an unexpected keyword argument 'held'",
}
FAULTS = """
idle = lab_plug_ins:Idle
sulking = lab_plug_ins:Sulking
figure = lab_plug_ins:FIGURE
ending = lab_ending:Nobody
"""
ENTRIES = (
    """[skein.planners]
calm = lab_plug_ins:Calm
fixed = lab_plug_ins:Fixed
alone = lab_plug_ins:Alone
short = lab_plug_ins:Short
holding = lab_plug_ins:Holding
hired = lab_plug_ins:hired
broken = no_such_module:Planner
"""
    + FAULTS
    + """[skein.cameras]
stumbling = lab_plug_ins:Stumbling
static = lab_plug_ins:Static
torn = no_such_module:Reader
"""
    + FAULTS
    + "[skein.world_sensors]"
    + FAULTS
    + "[skein.markers]"
    + FAULTS
)
REASONS = {
    "idle": "TypeError: Idle without ",
    "sulking": "RuntimeError: no licence",
    "figure": "TypeError: is of type int",
    "ending": "SystemExit: no display",
}


@pytest.fixture(autouse=True)
def _installed(tmp_path, monkeypatch):
    (tmp_path / "lab_plug_ins.py").write_text(CODE)
    (tmp_path / "lab_ending.py").write_text("import sys\n\nsys.exit('no display')\n")
    install(tmp_path, "lab-plug-ins", ENTRIES)
    monkeypatch.syspath_prepend(tmp_path)
    yield
    sys.modules.pop("lab_plug_ins", None)


def test_plug_ins_are_listed_without_loading_any():
    assert {"calm", "broken"} <= set(plug_ins.names(plug_ins.PLANNERS))
    assert "lab_plug_ins" not in sys.modules


def test_a_planner_of_another_package_plans():
    field = field_named("lab", ["planner.plug_in=calm"])
    worker_of = Mock()
    feed = TrackerFeed(Mock(), worker_of, "here")
    tracking = Tracking(MemoryBus(MemoryExchange(), "lab", "tracker"), TrackerSection(field, epoch=1), feed)
    worker_of.assert_called_once_with(tracking.tracker.planner)
    assert type(tracking.tracker.planner).__name__ == "Calm"


@pytest.mark.parametrize(("options", "guest"), [(["planner.plug_in=calm"], "planner calm (lab-plug-ins)"), ([], "")])
def test_the_supervisor_knows_the_planner_that_may_hang_the_tracker(tmp_path, options, guest):
    field = load_field(FIXTURE, options)
    table = process_table(field, "tcp/127.0.0.1:1", tmp_path, simulation=None, monitor=False)
    assert [row.guest for row in table if row.name == "tracker"] == [guest]


def test_a_planner_that_is_not_installed_is_refused_at_its_line():
    with pytest.raises(SettingsError, match=r"planner.plug_in: must be an installed planner: .*calm"):
        field_named("lab", ["planner.plug_in=hasty"])


@pytest.mark.parametrize("name", ["broken", "figure", "ending"])
def test_a_planner_that_cannot_be_loaded_is_refused_by_the_check_of_the_field(name):
    with pytest.raises(SettingsError, match=rf"planner.plug_in: {name} cannot be used: lab-plug-ins"):
        field_named("lab", [f"planner.plug_in={name}"])


@pytest.mark.parametrize("name", UNFIT)
def test_a_planner_that_cannot_plan_is_refused_by_the_check_of_the_field(name):
    with pytest.raises(SettingsError, match=rf"planner.plug_in: {name} cannot be used: lab-plug-ins .*{UNFIT[name]}"):
        field_named("lab", [f"planner.plug_in={name}"])


def test_a_planner_that_a_function_makes_is_judged_once_it_is_made():
    assert field_named("lab", ["planner.plug_in=hired"]).planner.plug_in == "hired"
    with pytest.raises(SettingsError, match=r"hired cannot be used: .*Short.plan is called with"):
        plug_ins.planner("hired", None, None)


def test_planners_of_other_packages_are_asked_as_ours_is():
    ours = list(signature(Planner.plan).parameters)
    assert ours == ["self", *plug_ins._PLANNED_FROM, "held"]
    assert list(signature(Planner).parameters)[:2] == ["parameters", "sensors"]


def test_a_planner_that_cannot_be_loaded_is_named():
    with pytest.raises(SettingsError, match=r"planner.plug_in: broken cannot be used: lab-plug-ins .*no_such_module"):
        plug_ins.planner("broken", None, None)


@pytest.mark.parametrize("name", REASONS)
def test_each_fault_of_a_plug_in_is_named_where_it_is_used(name):
    words = rf"{name} cannot be used: lab-plug-ins .*{REASONS[name]}"
    with pytest.raises(SettingsError, match=rf"planner.plug_in: {words}"):
        plug_ins.planner(name, None, None)
    with pytest.raises(DriverError, match=words):
        open_source(f"{name}://north")
    with pytest.raises(DriverError, match=words):
        open_system(SystemAddress(name, "127.0.0.1", 1))
    assert re.match(f"dictionary {words}", tag_fault(name, 1))
    assert plug_ins.load(plug_ins.PLANNERS, "calm").__name__ == "Calm", "the others work"


def test_two_packages_of_one_name_are_both_named_and_none_is_used(tmp_path):
    install(tmp_path, "lab-twin", "[skein.cameras]\nstatic = lab_plug_ins:Static\n")
    with pytest.raises(DriverError, match=r"static .*lab-plug-ins .* and lab-twin .* have the same name"):
        open_source("static://north")


def test_a_fault_while_reading_is_told_and_reading_goes_on():
    source = open_source("stumbling://north")
    try:
        assert source.take_newest(0.05) is None
        assert source.detail == "stumbling://north: ValueError: no picture of mine" and not source.connected
    finally:
        source.close()


def test_the_doctor_loads_each_and_names_those_that_fail():
    found = {finding.subject: finding for finding in plug_in_findings()}
    assert found["skein.planners calm"].level == "OK"
    for name in ("broken", "figure", "ending"):
        assert found[f"skein.planners {name}"].level == "SHOULD"
        assert "lab-plug-ins" in found[f"skein.planners {name}"].found


def test_a_source_of_another_package_is_read():
    assert parse_source("static://north/3").kind is SourceKind.PLUG_IN
    source = open_source("static://north/3")
    try:
        frame = source.take_newest(5.0)
        assert frame is not None and frame.picture is not None and np.all(frame.picture.grey() == 7)
    finally:
        source.close()


def test_a_source_that_cannot_be_loaded_is_named_and_others_work():
    with pytest.raises(DriverError, match=r"torn cannot be used: lab-plug-ins .*no_such_module"):
        open_source("torn://a")
    assert parse_source("http://127.0.0.1/a").kind is SourceKind.HTTP
    with pytest.raises(ValueError, match="must be an address"):
        parse_source("unheard://a")


def test_the_library_plans_a_step_of_the_shipped_field():
    planner = planner_of(field_named("lab"))
    robots = {"drone_1": (-0.8, 0.4, 1.2, 0.0), "drone_2": (-0.8, -0.5, 1.2, 0.2)}
    plan = plan_step(planner, belief_of(robots, {"turtlebot": (0.4, 0.0, 0.3, 0.0)}))
    assert set(plan.controls) == set(robots) and 0.0 < plan.uncertainty < 1.0
    assert plan.topology.robots == Topology.flat(robots).robots
