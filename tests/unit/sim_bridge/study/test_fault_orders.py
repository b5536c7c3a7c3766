"""Fault campaign specifications that its process refuses, with the remedy."""

import io
import json
import sys
from typing import Any

import msgspec
import pytest

from groundstation.errors import SettingsError
from groundstation.field.resolved import ResolvedField
from groundstation.process.program_digest import program_digest
from sim_bridge.fault_kinds import FaultKind
from sim_bridge.scenario import parse_scenario
from sim_bridge.study.faults.command import fly
from sim_bridge.study.faults.draw import draw
from sim_bridge.study.faults.flight_order import WrongOrder, fly_seeds
from sim_bridge.study.faults.hosted_kinds import WRONG_ORDER
from sim_bridge.study.scenarios.flight import as_drawn

FIELD: dict[str, Any] = {
    "room": {"fence": {"x_m": (-3.7, 3.7), "y_m": (-2.7, 2.7), "z_m": (0.0, 2.8)}},
    "cameras": {"ceiling": {}},
    "drones": {"drone_1": {"kind": "ardrone"}, "px4_1": {"kind": "mavlink"}},
}


@pytest.mark.parametrize(
    ("kinds", "said"),
    [
        (["frozn"], "no kind of fault: frozn; there are navdata_silent,"),
        (["none", "wind"], "none flies healthy flights only: name it alone"),
    ],
)
def test_kinds_that_mean_nothing_are_refused_in_one_line(
    kinds: list[str], said: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    order = {"field": {"drones": {}}, "sections": [], "scenario": {}, "seeds": [1], "seconds": 20.0, "kinds": kinds}
    monkeypatch.setattr(sys, "stdin", io.StringIO(json.dumps(order)))
    assert fly_seeds(fly) == WRONG_ORDER
    lines = capsys.readouterr().err.splitlines()
    assert len(lines) == 1 and lines[0].startswith(said)


def test_words_of_a_plug_in_are_no_results_and_its_failure_is_one_line(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def fly(_: Any, seed: int) -> dict[str, Any]:
        print("a planner says", seed)
        if seed == 2:
            raise SettingsError(["planner.plug_in clumsy: ZeroDivisionError: division by zero"])
        return {"seed": seed}

    order = {"field": {"drones": {}}, "sections": [], "scenario": {}, "seeds": [1, 2], "seconds": 20.0}
    monkeypatch.setattr(sys, "stdin", io.StringIO(json.dumps(order)))
    assert fly_seeds(fly) == WRONG_ORDER
    out, err = capsys.readouterr()
    (line,) = out.splitlines()
    assert json.loads(line) == {"seed": 1, "program": program_digest()}
    assert err.splitlines()[-1] == "planner.plug_in clumsy: ZeroDivisionError: division by zero"


@pytest.mark.parametrize(
    ("broken", "said"),
    [
        ({"kind": "ranges_silent", "entity": "uwb", "start_s": 5.0}, "ranges_silent of uwb: nothing breaks so"),
        (
            {"kind": "wrong_board", "entity": "a", "other": "b", "start_s": 5.0},
            "wrong_board of a: nothing breaks so at message level; fly it at the wire",
        ),
        (
            {"kind": "wind", "entity": "drone_9", "start_s": 5.0},
            "scenario: faults.0.entity: 'drone_9' is none of drone_1, drone_2$",
        ),
        (
            {"kind": "at_deaf", "entity": "ceiling", "start_s": 5.0},
            "scenario: faults.0.entity: 'ceiling' is none of drone_1, drone_2$",
        ),
        (
            {"kind": "camera_stall", "entity": "turtlebot", "start_s": 5.0},
            "scenario: faults.0.entity: 'turtlebot' is none of ceiling, drone_1, drone_2$",
        ),
    ],
)
def test_a_fault_that_would_break_nothing_is_refused(
    lab_field: ResolvedField, broken: dict[str, Any], said: str
) -> None:
    field = msgspec.to_builtins(lab_field)
    with pytest.raises(WrongOrder, match=f"^{said}"):
        as_drawn(field, parse_scenario(json.dumps({"faults": [broken]})), 1)


@pytest.mark.parametrize("kind", [FaultKind.BODY_TURNED, FaultKind.ANCHOR_FROZEN])
def test_faults_of_fixed_systems_are_flown_where_they_are_named_and_the_field_has_such(kind: FaultKind) -> None:
    systems = {"motion_capture": {"mocap": {}}, "ranging": {"uwb": {"anchors": {"a1": (0, 0, 2), "a2": (1, 0, 2)}}}}
    drawn = [draw(FIELD | systems, parse_scenario("{}"), s, (11.0, 20.0), (kind,)).scenario.faults for s in range(50)]
    found = {(fault.entity, fault.other) for faults in drawn for fault in faults}
    expected = {("drone_1", None), ("px4_1", None)}, {("uwb", "a1"), ("uwb", "a2")}
    assert found == expected[kind is FaultKind.ANCHOR_FROZEN]
    with pytest.raises(WrongOrder, match="nothing in this field can have such a fault"):
        draw(FIELD, parse_scenario("{}"), 1, (11.0, 20.0), (kind,))


@pytest.mark.parametrize("broken", [("at_deaf", "drone_1"), ("uniform_floor", "drone_2"), ("picture_black", "drone_1")])
def test_a_fault_that_breaks_something_is_flown(lab_field: ResolvedField, broken: tuple[str, str]) -> None:
    fault = {"kind": broken[0], "entity": broken[1], "start_s": 5.0}
    drawn = as_drawn(msgspec.to_builtins(lab_field), parse_scenario(json.dumps({"faults": [fault]})), 1)
    assert [(one.kind, one.entity) for one in drawn.scenario.faults] == [broken]
