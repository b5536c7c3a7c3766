"""Content of a run's page, and that it needs no other file."""

import json
import re
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import msgspec
import numpy as np
import pytest
from click.testing import CliRunner

from groundstation.bus import messages as m
from groundstation.cli.report import report as report_command
from groundstation.report.build import title
from groundstation.report.consistency import bounds, edges, nees_per_dof, windowed_nis
from groundstation.report.decisions import interventions, switches
from groundstation.report.findings import findings_of
from groundstation.report.judge import judge
from groundstation.report.links import links
from groundstation.report.page import tables
from groundstation.report.page.chart import chart_times, held
from groundstation.report.page.comparison import write_comparison
from groundstation.report.page.document import write_page
from groundstation.report.plot import draw
from groundstation.report.run_facts import RunFacts
from groundstation.report.story import Moment
from groundstation.report.tracks import UNKNOWN_FIELD, EstimateTrack, RunData, TimedMessage, TruthTrack

HEADER = m.Header(0, "here", "drone_1", "test", 0)


def innovation(time_s: float, nis: float, verdict: m.Verdict = m.Verdict.ACCEPTED) -> TimedMessage[m.Innovation]:
    message = m.Innovation(
        header=HEADER,
        observer="ceiling",
        subject="drone_1",
        verdict=verdict,
        residual=(0.0,) * 4,
        nis=nis,
        latency_ms=120.0,
    )
    return TimedMessage(time_s, message)


def plan(
    time_s: float, topology: str, cost: float, others: dict[str, float], *controls: m.Control
) -> TimedMessage[m.Plan]:
    alternatives = tuple(m.Alternative(name, value) for name, value in others.items())
    solver = m.SolverReport("ok", 1, 0.001, 1, 1)
    return TimedMessage(time_s, m.Plan(header=HEADER, topology=topology, cost=cost, controls=controls, edges=(),
                                alternatives=alternatives, solver=solver, mode="x"))  # fmt: skip


def run_with(**series: object) -> RunData:
    data = RunData(UNKNOWN_FIELD, RunFacts(), end_s=10.0)
    for name, value in series.items():
        setattr(data, name, value)
    return data


def test_bounds_are_those_of_the_chi_square_table() -> None:
    assert bounds(4) == pytest.approx((0.4844 / 4, 11.1433 / 4), rel=1e-3)


def test_an_honest_edge_lies_within_its_bounds_and_refusals_are_counted_by_verdict() -> None:
    rng = np.random.default_rng(4)
    found = [innovation(0.1 * k, float(value)) for k, value in enumerate(rng.chisquare(4, 400))]
    found += [innovation(41.0, 30.0, m.Verdict.INFLATED), innovation(41.1, 0.0, m.Verdict.LATE)]
    (edge,) = edges(run_with(innovations=found))
    assert edge.nis_per_dof is not None and edge.low is not None and edge.high is not None
    assert edge.low < edge.nis_per_dof < edge.high
    assert edge.refused == {"LATE": 1}
    assert edge.inflated_percent == pytest.approx(100 / 401)
    assert edge.latency_p50_ms == 120.0


def test_windows_of_nis_leave_out_seconds_without_observations() -> None:
    middles, nis, low, high = windowed_nis([innovation(0.2, 4.0), innovation(0.4, 8.0), innovation(2.5, 4.0)], 0.0, 4.0)
    assert middles.tolist() == [0.5, 2.5]
    assert nis.tolist() == [1.5, 1.0]
    assert (low < 1.0).all() and (high > 1.0).all() and high[0] < high[1]


def test_nees_counts_yaw_across_the_border_of_its_range() -> None:
    time_s = np.array([0.0, 1.0])
    truth = TruthTrack(time_s, np.zeros((2, 3)), np.array([3.1, 3.1]), np.array([False, False]))
    estimate = EstimateTrack("robot", time_s, np.array([[0.0, 0.0, 0.0, -3.1]] * 2), np.array([np.eye(4) * 0.01] * 2))
    assert nees_per_dof(time_s, truth, estimate) == pytest.approx([(2 * np.pi - 6.2) ** 2 / 0.01 / 4] * 2)


def test_every_switch_has_its_reason() -> None:
    plans = [
        plan(1.0, "a", 0.3, {}),
        plan(2.0, "a,b", 0.2, {"a,b": 0.2}),
        plan(3.0, "a/b", 0.1, {"a,b": 0.2, "a/b": 0.1}),
        plan(4.0, "a", 0.4, {"a": 0.4}),
    ]
    found = switches(run_with(plans=plans))
    assert [switch.reason for switch in found] == [
        "b joined the team",
        "the target's place should be known 50 % better this way",
        "b left the team",
    ]
    assert found[1].stay_cost == 0.2


def test_interventions_are_counted_in_episodes() -> None:
    times = (1.0, 1.1, 1.2, 5.0, 5.1)
    limited = m.Control("drone_1", (0.1, 0.0, 0.0), 0.0, limited_by=("fence",), wanted_m_s=(0.5, 0.3, 0.0))
    plans = [plan(time_s, "a", 0.1, {}, limited) for time_s in times]
    (found,) = interventions(run_with(plans=plans))
    assert (found.cause, found.episodes, found.plans) == ("fence", 2, 5)
    assert found.longest_s == pytest.approx(0.2)
    assert found.most_cut_m_s == pytest.approx(0.5)


def test_links_name_the_longest_silence_and_the_worst_quality() -> None:
    statuses = [
        TimedMessage(time_s, m.VehicleStatus(header=HEADER, flight_state=m.FlightState.FLYING, mode="TRACK",
                                      battery=level, link_quality=quality, rate_hz=rate, rejected={"checksum": count}))
        for time_s, level, quality, rate, count in (
            (0.0, 0.9, 1.0, 200.0, 0), (0.2, 0.9, 0.4, 150.0, 3), (2.2, 0.8, 0.9, 200.0, 1),
        )
    ]  # fmt: skip
    heard_s = {"drone_1": np.array([0.0, 0.01, 1.51, 1.52])}  # silent for 1.5 s while its driver continues
    (found,) = links(run_with(vehicles={"drone_1": statuses}, heard_s=heard_s))
    assert found.longest_silence_s == pytest.approx(1.5)
    assert links(run_with(vehicles={"drone_1": statuses}))[0].longest_silence_s is None
    assert (found.link_quality_min, found.battery, found.rejected) == (0.4, (0.9, 0.8), {"checksum": 3})


@pytest.mark.parametrize(("rates", "least"), [((0.0, 0.0, 50.0, 48.0), 48.0), ((0.0, 50.0, 0.0), 0.0), ((0.0,), 0.0)])
def test_the_least_rate_of_a_link_counts_from_its_first_telemetry(rates: tuple[float, ...], least: float) -> None:
    statuses = [
        TimedMessage(k, m.VehicleStatus(header=HEADER, flight_state=m.FlightState.LANDED, mode="LANDED", rate_hz=rate))
        for k, rate in enumerate(rates)
    ]
    assert links(run_with(vehicles={"drone_1": statuses}))[0].rate_hz_min == least


def test_held_values_expire_and_thinning_bounds_the_points() -> None:
    values = held(np.array([0.5, 1.0, 1.4, 3.0]), [1.0], [7.0], 0.5)
    assert np.isnan(values[[0, 3]]).all() and values[1:3].tolist() == [7.0, 7.0]
    assert len(chart_times(0.0, 10_000.0)) <= 3000


def sample_run(tmp_path: Path, name: str) -> tuple[RunData, Path]:
    folder = tmp_path / name
    folder.mkdir()
    events = [
        TimedMessage(
            2.0,
            m.Event(header=HEADER, severity=m.Severity.WARNING, text="<script>alert(1)</script>", remedy="</script>"),
        )
    ]
    data = run_with(
        events=events, innovations=[innovation(0.1 * k, 4.0) for k in range(50)],
        plans=[plan(0.1 * k, "a" if k < 25 else "b", 0.1, {}) for k in range(50)],
    )  # fmt: skip
    return data, folder


def test_page_needs_nothing_else_and_escapes_what_was_recorded(tmp_path: Path) -> None:
    data, folder = sample_run(tmp_path, "run & <b>")
    write_page(data, judge(data, folder), folder / "report.html")
    page = (folder / "report.html").read_text("utf-8")
    assert not re.search(r"""(?:src|href)\s*=\s*["'](?!\#)""", page.split("<script>")[0].replace('xlink:href="#', "#"))
    assert "<script>alert" not in page
    assert "<h1>run &amp; &lt;b&gt;</h1>" in page
    charts = json.loads(page.split('id="charts">')[1].split("</script>")[0])
    assert {"NIS", "Plan cost"} <= {chart["title"] for chart in charts}
    assert all(len(curve["values"]) == len(chart["time_s"]) for chart in charts for curve in chart["curves"])
    assert all(before < after for chart in charts for before, after in pairwise(chart["time_s"]))


def test_page_names_a_failure_that_no_criterion_shows(tmp_path: Path) -> None:
    data, folder = sample_run(tmp_path, "run")
    report = judge(data, folder)
    flown = msgspec.structs.replace(report.figures, flew=True)
    failed = replace(report, figures=flown, not_flown=None, criteria=(), broken_off="a process died", recorded_s=19.8)
    write_page(data, failed, folder / "report.html")
    page = (folder / "report.html").read_text("utf-8")
    assert "<p>a process died.</p><p>the recording breaks off after 20 s, before the run ended.</p>" in page
    write_page(data, replace(failed, invalid="the simulator did not keep real time"), folder / "report.html")
    assert (folder / "report.html").read_text("utf-8").count("he simulator did not keep real time") == 1


def test_comparison_lists_every_figure_with_its_change(tmp_path: Path) -> None:
    runs = [(data, judge(data, folder)) for data, folder in (sample_run(tmp_path, "one"), sample_run(tmp_path, "two"))]
    write_comparison((runs[0], runs[1]), tmp_path / "comparison.html")
    page = (tmp_path / "comparison.html").read_text("utf-8")
    assert "nis ceiling → drone_1" in page and "Plan cost" in page


def test_a_run_of_any_name_has_its_pages(tmp_path: Path) -> None:
    """A name that is no UTF-8 cannot be in a page, and is replaced there."""
    data, folder = sample_run(tmp_path, "run\udcff")
    report = judge(data, folder)
    write_page(data, report, tmp_path / "report.html")
    write_comparison(((data, report), (data, report)), tmp_path / "comparison.html")
    for page in ("report.html", "comparison.html"):
        assert "run\N{REPLACEMENT CHARACTER}" in (tmp_path / page).read_text()
    draw(data, title(report), tmp_path / "trajectories.png")


def test_a_long_story_says_what_it_leaves_out() -> None:
    moments = [Moment(float(k), "event", "something") for k in range(502)]
    assert tables.story_table(moments).count("something") == 500
    assert "2 more are in the recording." in tables.story_table(moments)
    assert "more are" not in tables.story_table(moments[:500])


def test_nothing_is_less_than_zero_by_rounding() -> None:
    assert [tables.number(value) for value in (-0.0001, 0.0, -0.001, 12.5, None)] == ["0", "0", "-0.001", "12.5", "–"]
    assert tables.number(-0.4, 0) == "0"


def test_findings_of_an_empty_run_are_empty() -> None:
    found = findings_of(run_with())
    assert (found.edges, found.switches, found.interventions, found.links) == ([], [], [], [])


@pytest.mark.parametrize("arguments", (["nowhere"], ["{run}", "--compare", "nowhere"]))
def test_a_run_that_is_not_there_is_named(tmp_path: Path, arguments: list[str]) -> None:
    filled = [argument.format(run=tmp_path) for argument in arguments]
    result = CliRunner().invoke(report_command, filled)
    assert "nowhere" in str(result.exception) and result.exit_code != 0
