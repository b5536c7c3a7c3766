"""Events of a run in the report: its story, faults and reactions; a flight that a failsafe ended has failed."""

import dataclasses

import msgspec
import pytest
from rich.console import Console

from groundstation.bus import messages as m
from groundstation.report.accuracy import Accuracy
from groundstation.report.criteria import Criterion, criteria_of
from groundstation.report.findings import findings_of
from groundstation.report.happenings import UNEXPLAINED, happenings, landings
from groundstation.report.judge import judge
from groundstation.report.metrics import figures_of
from groundstation.report.page.tables import criteria_table, happenings_table, story_table
from groundstation.report.run_facts import RunFacts
from groundstation.report.story import story
from groundstation.report.summary import summary
from groundstation.report.tracks import UNKNOWN_FIELD, RunData, TimedMessage
from groundstation.report.wording import bound, missed, quantity

UP, DOWN, SINKS = m.FlightState.FLYING, m.FlightState.LANDED, m.FlightState.LANDING


def header(entity="team"):
    return m.Header(0, "here", entity, "tester", 0)


def data(*statuses, events=(), commands=()):
    """Return the data of one drone, from (time, state, mode, failsafe)."""
    told = [
        TimedMessage(
            float(at),
            m.VehicleStatus(header=header("a"), flight_state=state, mode=mode, failsafe=why, detail=f"because {why}"),
        )
        for at, state, mode, why in statuses
    ]
    found = [TimedMessage(at, event(text, injected)) for at, text, injected in events]
    ordered = [
        TimedMessage(at, m.Command(header=header(), id="x", verb=verb, scope=scope, issuer="me"))
        for at, verb, scope in commands
    ]
    return RunData(UNKNOWN_FIELD, RunFacts(), end_s=60.0, vehicles={"a": told}, events=found, commands=ordered)


def event(text, injected=True):
    return m.Event(header=header("a"), severity=m.Severity.WARNING, text=text, injected=injected)


LANDED_BY_FAILSAFE = data(
    (1, UP, "TRACK", ""),
    (12, UP, "HOVER", "telemetry_silent"),
    (12.2, UP, "HOVER", "telemetry_silent"),
    (14, SINKS, "LANDING", "telemetry_silent"),
    (18, DOWN, "LANDED", ""),
    events=[(11.0, "fault navdata_silent of a begins", True), (13.0, "something else", False)],
    commands=[(30.0, m.Verb.LAND, ())],
)


def test_faults_and_reactions_stand_in_order_of_time_each_once():
    found = happenings(LANDED_BY_FAILSAFE)
    assert [(item.time_s, item.cause, item.ended_flight) for item in found] == [
        (11.0, "fault", False),
        (12.0, "telemetry_silent", False),
        (14.0, "telemetry_silent", True),
    ]
    assert "because telemetry_silent" in found[2].text


def test_a_flight_that_a_failsafe_ended_fails_and_says_which():
    figures = figures_of(LANDED_BY_FAILSAFE)
    criterion = next(c for c in criteria_of(figures, UNKNOWN_FIELD, RunFacts()) if c.name == "failsafe_landings")
    assert (criterion.ok, criterion.value) == (False, 1.0)
    assert criterion.why == "14.0 s  a: LANDING by failsafe telemetry_silent: because telemetry_silent"


def test_the_summary_and_the_page_show_fault_and_reaction(tmp_path):
    report = judge(LANDED_BY_FAILSAFE, tmp_path)
    console = Console(width=300, file=None, record=True)
    with console.capture() as printed:
        console.print(summary(report))
    verdict = printed.get().splitlines()[0]
    assert verdict.startswith("FAILED") and "failsafe telemetry_silent" in verdict
    for text in (printed.get(), happenings_table(findings_of(LANDED_BY_FAILSAFE))):
        assert text.index("navdata_silent of a begins") < text.rindex("LANDING by failsafe telemetry_silent")
    assert "because telemetry_silent" in criteria_table(report)


@pytest.mark.parametrize(("anees", "doubted"), [(1.1, False), (7.55, True)])
def test_the_summary_doubts_a_target_that_is_not_where_it_was_believed(tmp_path, anees, doubted):
    report = judge(LANDED_BY_FAILSAFE, tmp_path)
    target = Accuracy(rmse_m=0.06, max_error_m=0.1, lost_s=0.0, covered=1.0, anees=anees)
    report = dataclasses.replace(report, figures=msgspec.structs.replace(report.figures, targets={"car": target}))
    console = Console(width=300)
    with console.capture() as printed:
        console.print(summary(report))
    assert f"normalised error {anees:.2f}" in printed.get()
    assert ("groundstation calibrate team looks for it" in printed.get()) is doubted


def test_a_pause_that_ended_well_is_told_and_fails_nothing():
    flown = data((1, UP, "TRACK", ""), (5, UP, "HOVER", "driver_stood"), (9, UP, "TRACK", ""))
    assert [item.cause for item in happenings(flown)] == ["driver_stood"]
    assert landings(happenings(flown)) == []


def test_an_ordered_landing_is_no_failsafe():
    for scope in ((), ("a",)):
        flown = data((1, UP, "TRACK", ""), (9, DOWN, "LANDED", ""), commands=[(8.0, m.Verb.LAND, scope)])
        assert happenings(flown) == []


def test_an_ordered_landing_that_was_late_for_a_moment_is_no_failsafe_either():
    flown = data(
        (1, UP, "TRACK", ""), (9, SINKS, "LANDING", ""), (18, SINKS, "LANDING", "landing_overdue"),
        (19, SINKS, "LANDING", ""), (20, DOWN, "LANDED", ""), commands=[(9.0, m.Verb.LAND, ("a",))],
    )  # fmt: skip
    assert [item.cause for item in happenings(flown)] == ["landing_overdue"]
    assert landings(happenings(flown)) == []


def test_a_failsafe_that_lands_is_told_once_though_its_landing_is_late_meanwhile():
    causes = ["battery_low", "landing_overdue", "battery_low"]
    flown = data((1, UP, "TRACK", ""), *((9 + i, SINKS, "LANDING", why) for i, why in enumerate(causes)))
    assert [item.cause for item in happenings(flown)] == causes[:2]


@pytest.mark.parametrize(
    ("scope", "ordered_s", "falls"),
    [((), 5.0, True), (("a",), 5.0, True), (("b",), 5.0, False), (("a", m.OPERATOR), 5.0, False), ((), 9.5, False)],
    ids=["all", "it", "another", "a wish to the operator", "on the ground"],
)
def test_a_drone_whose_motors_were_cut_in_the_air_did_not_land_well(scope, ordered_s, falls):
    """It is on the ground at the end, and no failsafe put it there."""
    ordered = [(ordered_s, m.Verb.CUT_MOTORS, scope), (ordered_s + 0.1, m.Verb.CUT_MOTORS, scope)]
    flown = data((1, UP, "TRACK", ""), (5.2 if falls else 9, DOWN, "CUT", ""), commands=ordered)
    criteria = {one.name: one for one in criteria_of(figures_of(flown), UNKNOWN_FIELD, RunFacts())}
    assert criteria["landed"].ok
    assert ("cuts_in_flight" in criteria) is falls
    if falls:
        assert not criteria["cuts_in_flight"].ok
        assert criteria["cuts_in_flight"].why == "5.0 s  a: motors cut in the air by me"


def test_an_order_to_cut_that_the_driver_refused_cut_nothing():
    flown = data((1, UP, "TRACK", ""), commands=[(5.0, m.Verb.CUT_MOTORS, ())])
    refused = m.CommandAck(header=header("a"), command_id="x", verb=m.Verb.CUT_MOTORS, stage=m.AckStage.REFUSED)
    assert len(figures_of(flown).cuts_in_flight) == 1
    flown.acks.append(TimedMessage(5.1, refused))
    assert figures_of(flown).cuts_in_flight == []


def test_a_landing_without_command_and_driver_is_unexplained():
    rises = data(
        (1, m.FlightState.TAKING_OFF, "TAKING_OFF", ""), (3.03, UP, "LANDING", ""), (7, DOWN, "LANDED", ""),
        commands=[(3.0, m.Verb.LAND, ())],
    )  # fmt: skip
    assert landings(happenings(rises)) == [], "ordered while it took off"
    flown = data((1, UP, "TRACK", ""), (6, DOWN, "CONNECTING", ""), commands=[(8.0, m.Verb.LAND, ())])
    assert [(item.time_s, item.cause) for item in landings(happenings(flown))] == [(6.0, UNEXPLAINED)]
    of_another = data((1, UP, "TRACK", ""), (6, DOWN, "LANDED", ""), commands=[(5.0, m.Verb.LAND, ("b",))])
    assert len(landings(happenings(of_another))) == 1


def test_an_order_of_a_former_flight_explains_nothing():
    flown = data(
        (1, UP, "TRACK", ""),
        (3, DOWN, "LANDED", ""),
        (5, UP, "TRACK", ""),
        (8, DOWN, "LANDED", ""),
        commands=[(2.0, m.Verb.LAND, ())],
    )
    assert [item.time_s for item in landings(happenings(flown))] == [8.0]


def test_a_fault_from_before_the_recording_is_told_once():
    lasting = data(events=[(4.0, "fault wind 1 of a lasts", True)])
    assert [item.text for item in happenings(lasting)] == ["fault wind 1 of a begins, or did before"]
    known = data(events=[(2.0, "fault wind 1 of a begins", True), (4.0, "fault wind 1 of a lasts", True)])
    assert [item.time_s for item in happenings(known)] == [2.0]


def test_only_the_first_of_a_drones_ends_is_counted():
    flown = data((1, UP, "TRACK", ""), (5, SINKS, "LANDING", "battery_low"), (6, SINKS, "CUT", "emergency"))
    assert [item.cause for item in landings(happenings(flown))] == ["battery_low"]
    assert figures_of(flown).failsafe_landings == [item.line for item in landings(happenings(flown))]
    assert msgspec.json.decode(judge(flown, None).as_json())["failsafe_landings"]  # type: ignore[arg-type]


def test_fault_failsafe_and_landing_stand_in_order():
    assert [(item.time_s, item.kind) for item in story(LANDED_BY_FAILSAFE)] == [
        (1.0, "flight"),
        (1.0, "flight"),
        (11.0, "fault"),
        (12.0, "failsafe"),
        (13.0, "warning"),
        (14.0, "failsafe"),
        (18.0, "flight"),
        (30.0, "order"),
    ]


def test_a_repeated_warning_stands_once_and_each_flight_is_told():
    flown = data(
        (1, UP, "TRACK", ""), (3, DOWN, "LANDED", ""), (5, UP, "TRACK", ""), (8, DOWN, "LANDED", ""),
        events=[(2.0, "battery low", False), (2.5, "battery low", False)],
    )  # fmt: skip
    texts = [item.text for item in story(flown)]
    assert texts.count("a: battery low") == 1
    assert texts.count("a is in the air") == 2


def test_the_page_marks_what_was_bad():
    assert '<td class="bad">failsafe</td>' in story_table(story(LANDED_BY_FAILSAFE))


def test_criteria_are_told_in_words_with_units():
    criterion = Criterion("min_separation_m", 0.41, ">=", 0.6, False, "a and b")
    assert missed(criterion) == "least separation 0.41 m, asked for at least 0.6 m (a and b)"
    assert (quantity("landed", False), quantity("target_rmse_m", None)) == ("no", "not measured")
    assert bound(Criterion("landed", True, "==", True, True)) == "yes"
    assert quantity("anything_else", 1.0) == "1"


LOST = m.FlightState.LOST


@pytest.mark.parametrize(
    ("last", "landed"),
    [
        ([(9, DOWN, "LANDED", "")], True),
        ([(9, DOWN, "LANDED", ""), (12, LOST, "CONNECTING", "")], True),
        ([(9, m.FlightState.EMERGENCY, "CUT", "")], True),
        ([(9, SINKS, "LANDING", "")], False),
        ([(9, LOST, "TRACK", "")], False),
        ([], False),
    ],
)
def test_a_flight_without_truth_fails_where_a_drone_never_said_that_it_landed(last, landed):
    flown = data((1, DOWN, "LANDED", ""), (2, UP, "TRACK", ""), *last, commands=[(8.0, m.Verb.LAND, ())])
    figures = figures_of(flown)
    assert figures.landed is landed
    (criterion,) = [one for one in criteria_of(figures, UNKNOWN_FIELD, RunFacts()) if one.name == "landed"]
    assert criterion.ok is landed


def test_a_drone_that_never_flew_has_no_landing_criterion():
    figures = figures_of(data((1, DOWN, "LANDED", ""), (2, LOST, "CONNECTING", "")))
    assert figures.landed is None
    assert "landed" not in {one.name for one in criteria_of(figures, UNKNOWN_FIELD, RunFacts())}
