"""A scenario's flight is judged by the scenario's expectation, as the report states; others by the usual limits."""

from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import pytest

from groundstation.bus.messages import AckStage, Command, CommandAck, Header, Verb
from groundstation.field.resolved import ResolvedField
from groundstation.recording.stretch import Stretch
from groundstation.report import run_facts
from groundstation.report.criteria import Criterion, criteria_of
from groundstation.report.judge import judge
from groundstation.report.metrics import figures_of
from groundstation.report.run_facts import RunFacts
from groundstation.report.summary import summary
from groundstation.report.tracks import EstimateTrack, RunData, TimedMessage, TruthTrack
from groundstation.report.wording import bound, missed
from groundstation.settings.files import SHIPPED
from groundstation.settings.scenario import load_scenario

GRID = np.arange(0.0, 40.0, 0.05)
KIDNAP = {"lost_s": 12}


def flight(lab_field: ResolvedField, expected: Any, *, lost: tuple[float, float], off_m: float = 0.0) -> RunData:
    """Return a flight that tracks for 40 s, with a target error of 3 m during that time and of off_m otherwise."""
    header = Header(0, "c", "drone_1", "drone_1", 1)
    away = np.where(np.searchsorted(lost, GRID, side="right") == 1, 3.0, off_m)
    places = np.column_stack((away, np.zeros(len(GRID))))
    standing = TruthTrack(GRID, np.zeros((len(GRID), 3)), np.zeros(len(GRID)), np.ones(len(GRID), dtype=bool))
    return RunData(
        lab_field,
        RunFacts(mode="sitl", scenario="kidnap-3m", expected=expected),
        truth={"turtlebot": standing, **dict.fromkeys(lab_field.drones, standing)},
        estimates={"turtlebot": EstimateTrack("target", GRID, places, np.tile(np.eye(2), (len(GRID), 1, 1)))},
        acks=[
            TimedMessage(0.0, CommandAck(header=header, command_id="1", verb=Verb.TRACK, stage=AckStage.EFFECTIVE)),
        ],
        commands=[TimedMessage(40.0, Command(header=header, id="2", verb=Verb.LAND, scope=(), issuer="me"))],
    )


def about_the_target(data: RunData) -> dict[str, Criterion]:
    found = criteria_of(figures_of(data), data.resolved, data.facts)
    return {one.name: one for one in found if one.name.startswith("target")}


def test_a_loss_that_the_scenario_expects_fails_nothing_and_says_who_allows_it(lab_field: ResolvedField) -> None:
    data = flight(lab_field, KIDNAP, lost=(15.0, 23.0))
    found = about_the_target(data)
    assert all(one.ok for one in found.values())
    assert found["target_lost_s"].value == pytest.approx(8.0, abs=0.11)
    assert bound(found["target_lost_s"]) == "at most 12 s by scenario kidnap-3m"
    assert found.keys() == {"target_kept_rmse_m", "target_lost_s"}
    assert bound(found["target_kept_rmse_m"]) == "at most 0.2 m"


def test_without_an_expectation_the_usual_limits_stand(lab_field: ResolvedField) -> None:
    found = about_the_target(flight(lab_field, None, lost=(15.0, 23.0)))
    assert {name: one.limit for name, one in found.items()} == {"target_rmse_m": 0.2, "target_lost_s": 2.0}
    assert not any(one.ok or one.by for one in found.values())


def test_a_loss_beyond_what_is_expected_fails(lab_field: ResolvedField) -> None:
    found = about_the_target(flight(lab_field, KIDNAP, lost=(15.0, 28.0)))
    assert missed(found["target_lost_s"]) == "target lost 13 s, asked for at most 12 s by scenario kidnap-3m"


def test_a_loss_excuses_no_error_before_and_after_it(lab_field: ResolvedField) -> None:
    found = about_the_target(flight(lab_field, KIDNAP, lost=(15.0, 20.0), off_m=0.25))
    assert found["target_lost_s"].ok and not found["target_kept_rmse_m"].ok


def test_a_stricter_expectation_than_the_usual_limit_tightens_nothing(lab_field: ResolvedField) -> None:
    found = about_the_target(flight(lab_field, {"rmse_m": 0.05, "lost_s": 0}, lost=(0.0, 0.0), off_m=0.1))
    assert {name: (one.limit, one.ok, one.by) for name, one in found.items()} == {
        "target_rmse_m": (0.2, True, ""), "target_lost_s": (2.0, True, ""),
    }  # fmt: skip


def test_where_a_search_is_expected_errors_count_from_when_the_target_was_found(lab_field: ResolvedField) -> None:
    searched = {"found_s": 25, "seconds": 40}
    found = about_the_target(flight(lab_field, searched, lost=(0.0, 20.0)))
    assert all(one.ok for one in found.values())
    assert (found["target_found_s"].value, found["target_lost_s"].value) == (20.0, 0.0)
    late = about_the_target(flight(lab_field, searched, lost=(0.0, 26.0)))
    assert [name for name, one in late.items() if not one.ok] == ["target_found_s"]
    never = about_the_target(flight(lab_field, searched, lost=(0.0, 41.0)))
    assert not any(one.ok for one in never.values())
    assert "never found" in missed(never["target_found_s"])


def reasons(field: ResolvedField, **covered: float) -> list[str]:
    """Return the reasons of a flight's failure by its last target, each covered for a share of the time."""
    data = flight(field, None, lost=(15.0, 28.0))
    figures = figures_of(data)
    (bad,) = figures.targets.values()
    good = msgspec.structs.replace(bad, rmse_m=0.01, lost_s=0.0)
    *others, last = covered
    targets = dict.fromkeys(others, good) | {last: msgspec.structs.replace(bad, covered=covered[last])}
    criteria = criteria_of(msgspec.structs.replace(figures, targets=targets), field, data.facts)
    return [item.why for item in criteria if item.name in ("target_rmse_m", "target_lost_s")]


def test_a_target_that_was_never_found_is_called_so_and_of_several_the_worst_is_named(
    lab_field: ResolvedField,
) -> None:
    assert reasons(lab_field, rabbit=0.0) == ["never found"] * 2
    assert reasons(lab_field, rabbit=0.7) == [""] * 2
    assert reasons(lab_field, rabbit=1.0, fox=0.7) == ["fox"] * 2
    assert reasons(lab_field, rabbit=1.0, fox=0.0) == ["fox: never found"] * 2


def test_landings_that_are_expected_are_counted(lab_field: ResolvedField) -> None:
    data = flight(lab_field, {"landings": 1}, lost=(0.0, 0.0))
    for landed, good in (([], True), (["drone_1"], True), (["drone_1", "drone_2"], False)):
        figures = msgspec.structs.replace(figures_of(data), failsafe_landings=landed)
        (one,) = (one for one in criteria_of(figures, lab_field, data.facts) if one.name == "failsafe_landings")
        assert (one.ok, one.limit, one.by) == (good, 1.0, "scenario kidnap-3m")


@pytest.mark.parametrize("wrong", [5, "soon", [1], {"lost_s": "long"}, {"lost_s": -1}, {"landings": 0.5}])
def test_an_expectation_that_cannot_be_read_is_told_and_the_usual_limits_stand(
    lab_field: ResolvedField, tmp_path: Path, wrong: Any
) -> None:
    run_facts.write(tmp_path, RunFacts(mode="sitl", scenario="kidnap-3m", expected=wrong))
    data = flight(lab_field, run_facts.read(tmp_path).expected, lost=(15.0, 23.0))
    report = judge(data, tmp_path)
    assert report.damage[0].startswith("run.json: what scenario kidnap-3m expects cannot be read (")
    assert next(one for one in report.criteria if one.name == "target_lost_s").limit == 2.0
    summary(report)
    report.as_json()


def test_a_cut_is_judged_by_no_expectation(lab_field: ResolvedField, tmp_path: Path) -> None:
    data = flight(lab_field, {"lost_s": "long"}, lost=(15.0, 23.0))
    data.stretch = Stretch(1, 2)
    report = judge(data, tmp_path)
    assert (report.criteria, report.damage, report.passed) == ((), (), None)


@pytest.mark.parametrize("name", ["kidnap-3m", "corner", "dying-drone", "four-drones", "realistic"])
def test_expectations_of_shipped_scenarios_are_readable(lab_field: ResolvedField, tmp_path: Path, name: str) -> None:
    told = load_scenario(SHIPPED / "scenarios" / f"{name}.yaml").get("expected")
    assert judge(flight(lab_field, told, lost=(0.0, 0.0)), tmp_path).damage == ()
