"""A flight of a drone whose own reports are not recorded is no good one: nobody knows where it went and came down."""

from collections.abc import Sequence

import pytest

from groundstation.bus import messages as m
from groundstation.field.resolved import ResolvedField
from groundstation.report.criteria import criteria_of
from groundstation.report.judge import judge
from groundstation.report.metrics import figures_of
from groundstation.report.run_facts import RunFacts
from groundstation.report.tracks import UNKNOWN_FIELD, RunData, TimedMessage

TEAM = ("drone_1", "drone_2")
LANDED, FLYING, LOST = m.FlightState.LANDED, m.FlightState.FLYING, m.FlightState.LOST
Reports = list[TimedMessage[m.VehicleStatus]]


def _header(entity: str = "team") -> m.Header:
    return m.Header(0, "here", entity, "tester", 0)


def _reports(begin_s: float = 5.0, end_s: float = 45.0, state: m.FlightState = FLYING) -> Reports:
    """Return five reports a second for 60 s, flying from begin to end."""
    told = [(k / 5.0, state if begin_s <= k / 5.0 < end_s else LANDED) for k in range(300)]
    modes = {FLYING: "TRACK", LANDED: "LANDED", LOST: "CONNECTING"}
    return [
        TimedMessage(at_s, m.VehicleStatus(header=_header(), flight_state=now, mode=modes[now])) for at_s, now in told
    ]


def _data(field: ResolvedField, moved: Sequence[str] = TEAM, begin_s: float = 6.0) -> RunData:
    """Return a flight of 60 s with reports of both drones, and plans for some, from a time to 45 s."""
    solver = m.SolverReport("complete", 1, 0.01, 1, 1)
    controls = tuple(m.Control(name, (0.0, 0.0, 0.0), 0.0) for name in moved)
    plan = m.Plan(header=_header(), topology="a", cost=0.1, controls=controls, edges=(), alternatives=(),
                  mode="multistart", solver=solver)  # fmt: skip
    track = m.CommandAck(header=_header(moved[0]), command_id="1", verb=m.Verb.TRACK, stage=m.AckStage.ACCEPTED)
    plans = [TimedMessage(begin_s + k / 10.0, plan) for k in range(int(10 * (45.0 - begin_s)))]
    vehicles = {name: _reports() for name in TEAM}
    return RunData(field, RunFacts(mode="fly"), end_s=60.0, acks=[TimedMessage(6.0, track)], plans=plans,
                   vehicles=vehicles)  # fmt: skip


def _missed(data: RunData) -> set[str]:
    criteria = criteria_of(figures_of(data), data.resolved, data.facts)
    return {one.name for one in criteria if not one.ok} & {"landed", "drone_uncertain_s", "field_read"}


@pytest.mark.parametrize(
    ("reports", "missing"),
    [
        ({}, True),
        ({"drone_1": _reports()}, True),
        ({"drone_1": _reports(), "drone_2": _reports()[:20]}, True),
        ({"drone_1": _reports(), "drone_2": [*_reports()[:20], *_reports()[240:]]}, True),
        ({"drone_1": _reports(), "drone_2": _reports(state=LOST)}, True),
        ({"drone_1": _reports(), "drone_2": _reports()}, False),
    ],
    ids=["none", "one drone's", "before it took off", "before and after", "only of its silence", "all"],
)
def test_who_flew_without_a_report_was_not_judged(
    lab_field: ResolvedField, reports: dict[str, Reports], missing: bool
) -> None:
    data = _data(lab_field)
    data.vehicles = reports
    data.certainties.clear()
    found = {one.name: one for one in criteria_of(figures_of(data), data.resolved, data.facts)}
    assert (found["landed"].value is None, found["drone_uncertain_s"].value is None) == (missing, missing)
    assert not missing or "drone_2" in found["landed"].why


@pytest.mark.parametrize("absent", [[], _reports(60.0, 60.0), _reports(0.0, 60.0, LOST)])
def test_a_drone_that_took_no_part_owes_no_report(lab_field: ResolvedField, absent: Reports) -> None:
    """Its driver may be broken, it may stand, or be switched off."""
    data = _data(lab_field, ("drone_1",))
    data.vehicles["drone_2"] = absent
    figures = figures_of(data)
    assert (figures.landed, figures.unreported) == (True, [])


def test_a_drone_that_joins_late_and_lands_before_the_others_is_known(lab_field: ResolvedField) -> None:
    data = _data(lab_field, begin_s=20.2)
    data.vehicles["drone_2"] = _reports(20.0, 44.5)
    assert figures_of(data).unreported == []


def test_plans_tell_of_a_flight_of_which_nothing_else_is_recorded(lab_field: ResolvedField) -> None:
    data = _data(lab_field)
    data.acks.clear()
    data.vehicles.clear()
    report = judge(data, None)  # type: ignore[arg-type]
    assert (report.verdict, figures_of(data).flew) == ("failed", True)
    assert any("no report of drone_1, drone_2 in flight is recorded" in reason for reason in report.reasons)


def test_a_flight_in_an_unknown_field_is_not_passed(lab_field: ResolvedField) -> None:
    assert "field_read" not in _missed(_data(lab_field))
    assert "field_read" in _missed(_data(UNKNOWN_FIELD))
