"""Reasons in the report for distrusting a run: sensors, surveys, delays, links, and warnings of the flight."""

import random

import msgspec
import numpy as np
import pytest

from groundstation.bus import messages as m
from groundstation.field.room import LensCalibration, WorldCamera
from groundstation.report.page.trust_section import trust_section
from groundstation.report.run_facts import RunFacts
from groundstation.report.tracks import UNKNOWN_FIELD, ProcessTrack, RunData, TimedMessage
from groundstation.report.trust import trust_of

LENS = LensCalibration(
    model="plumb_bob", width_px=1280, height_px=720, fx_px=900.0, fy_px=900.0, cx_px=640.0, cy_px=360.0,
    distortion=(0.0, 0.0, 0.0, 0.0, 0.0),
)  # fmt: skip
CEILING = WorldCamera(source="x", calibration=LENS, position_m=(0.0, 0.0, 4.2))


def header(source: str = "tracker", entity: str = "team") -> m.Header:
    return m.Header(0, "here", entity, source, 0)


def innovations(
    scale: float = 1.0, refused: float = 0.0, until_s: float = 20.0, subject: str = "drone_1"
) -> list[TimedMessage[m.Innovation]]:
    """Return 15 innovations a second of the ceiling camera, with squared errors `scale` times the stated ones."""
    rng = random.Random(1)
    found = []
    for i in range(round(15 * until_s)):
        verdict = m.Verdict.IMPLAUSIBLE if rng.random() < refused else m.Verdict.ACCEPTED
        nis = scale * sum(rng.gauss(0, 1) ** 2 for _ in range(3))
        message = m.Innovation(
            header=header(), observer="ceiling", subject=subject, verdict=verdict, residual=(0.0,) * 3, nis=nis
        )
        found.append(TimedMessage(i / 15, message))
    return found


def run_with(**series: object) -> RunData:
    data = RunData(msgspec.structs.replace(UNKNOWN_FIELD, cameras={"ceiling": CEILING}), RunFacts(), end_s=20.0)
    for name, value in series.items():
        setattr(data, name, value)
    return data


def belief(moved_m: float = 0.0, turned_rad: float = 0.0, late_ms: float = 0.0) -> m.Belief:
    layout = tuple(f"ceiling.{what}" for what in ("x", "y", "z", "yaw", "roll_error", "pitch_error"))
    mean = (moved_m, 0.0, 4.2, 0.0, turned_rad, 0.0)
    lateness = (m.SensorLateness("ceiling", late_ms, 5.0),)
    return m.Belief(header=header(), mean=mean, covariance_upper=(), layout=layout, lateness=lateness)


def planned(observer: str, subject: str, information: float = 2000.0) -> list[TimedMessage[m.Plan]]:
    solver = m.SolverReport("ok", 1, 0.001, 1, 1)
    edges = (m.Edge(observer, subject, information),)
    return [
        TimedMessage(
            0.5 * i,
            m.Plan(header=header(), topology="x", cost=1.0, controls=(), edges=edges, alternatives=(), solver=solver,
                   mode="TRACK"),
        )
        for i in range(40)
    ]  # fmt: skip


def test_nothing_speaks_against_a_healthy_run() -> None:
    trust = trust_of(
        run_with(innovations=innovations(), belief=belief(0.01, 0.002, 5.0), plans=planned("ceiling", "drone_1"))
    )
    assert trust.doubts == []
    (ceiling,) = trust.sensors
    assert ceiling.verdict == "consistent"
    assert ceiling.nis_per_dof == pytest.approx(1.0, abs=0.15)
    assert ceiling.low is not None and ceiling.high is not None and 0.02 < ceiling.high - ceiling.low < 0.5
    assert trust.links[0].seen_percent == pytest.approx(100.0, abs=0.1)
    assert "No reason to doubt them." in trust_section(trust)


@pytest.mark.parametrize(
    ("verdict", "doubt"),
    [
        (m.Verdict.LATE, "100 % of what ceiling saw was refused, most as too late: its link or its driver lags"),
        (m.Verdict.UNSYNCED, "100 % of what ceiling saw was refused, most as of an unknown clock: its host's clock"),
        (m.Verdict.SINGULAR, "100 % of what ceiling saw was refused, most as without a usable covariance"),
        (m.Verdict.FROZEN, "100 % of what ceiling saw was refused, most as repeated: its sensor or stream hangs"),
        (m.Verdict.UNKNOWN_ENTITY, ""),
        (m.Verdict.NOT_PERMITTED, ""),
    ],
)
def test_a_camera_that_is_refused_altogether_is_in_doubt(verdict: m.Verdict, doubt: str) -> None:
    """But not one that only sees drones on the floor, or a target that it is not to observe."""
    refused = [TimedMessage(one.time_s, msgspec.structs.replace(one.message, verdict=verdict)) for one in innovations()]
    doubts = trust_of(run_with(innovations=refused)).doubts
    assert [found[: len(doubt)] for found in doubts] == ([doubt] if doubt else [])


def test_an_empty_run_has_no_doubts() -> None:
    assert trust_of(run_with()).doubts == []


@pytest.mark.parametrize(
    ("series", "words"),
    [
        (
            {"innovations": innovations(scale=4.0)},
            ("ceiling is wrong by more than it claims", "groundstation calibrate"),
        ),
        (
            {"innovations": innovations(refused=0.3)},
            ("of what ceiling saw was refused, most as implausible: check how",),
        ),
        (
            {"belief": belief(moved_m=0.05)},
            ("ceiling seems to hang 0.050 m", "5 standard", "calibrate team"),
        ),
        ({"belief": belief(turned_rad=0.02)}, ("ceiling seems to hang 1.1 deg", "6 standard deviations")),
        ({"belief": belief(late_ms=-40.0)}, ("pictures of ceiling come 40 +- 5 ms earlier", "calibrate delay")),
        ({"plans": planned("ceiling", "drone_2")}, ("plans counted on ceiling seeing drone_2 for 20 s", "0 %")),
    ],
)
def test_a_doubt_names_its_cause_and_remedy(series: dict[str, object], words: tuple[str, ...]) -> None:
    trust = trust_of(run_with(**series))
    (doubt,) = trust.doubts
    for word in words:
        assert word in doubt
    assert "<li>" in trust_section(trust)


def test_a_link_of_which_a_plan_expected_next_to_nothing_need_not_see() -> None:
    """A topology permits a camera to observe robots outside of its picture."""
    trust = trust_of(run_with(plans=planned("ceiling", "drone_2", information=6.0)))
    assert trust.links == [] and trust.doubts == []


def test_repeated_warnings_of_the_tracker_are_one_doubt() -> None:
    warning = m.Event(
        header=header(entity="ceiling"), severity=m.Severity.WARNING, text="ceiling was bumped", remedy="fix it"
    )
    others = m.Event(header=header("drone_1"), severity=m.Severity.WARNING, text="drone_1 HOVER", remedy="RESUME")
    trust = trust_of(
        run_with(events=[TimedMessage(7.0, warning), TimedMessage(9.0, warning), TimedMessage(9.5, others)])
    )
    assert trust.doubts == ["told in flight, at 7 s: ceiling was bumped; fix it"]


def test_warnings_of_the_diagnosis_are_doubts() -> None:
    warning = m.Event(
        header=header("diagnosis", "drone_1"), severity=m.Severity.WARNING, text="its lens is 3 % longer", remedy="do"
    )
    assert trust_of(run_with(events=[TimedMessage(24.0, warning)])).doubts == [
        "told in flight, at 24 s: its lens is 3 % longer; do"
    ]


@pytest.mark.parametrize(("tracked_s", "verdicts", "ran", "told"), [
    (45.0, 0, True, True), (45.0, 1, True, False), (20.0, 0, True, False), (45.0, 0, False, False),
])  # fmt: skip
def test_silence_of_a_diagnosis_that_reached_no_verdict_is_a_doubt(
    tracked_s: float, verdicts: int, ran: bool, told: bool
) -> None:
    """On a machine that is too busy it gets no processor time, and everything looks healthy."""
    ack = m.CommandAck(
        header=header("drone_1", "drone_1"), command_id="1", verb=m.Verb.TRACK, stage=m.AckStage.ACCEPTED
    )
    nothing = TimedMessage(9.0, m.Suspicion(header=header("diagnosis"), cause=""))
    process = ProcessTrack(np.zeros(1), np.zeros(1), np.zeros((1, 4)), np.zeros(1), np.zeros(1))
    doubts = trust_of(
        run_with(
            acks=[TimedMessage(1.0, ack)],
            end_s=1.0 + tracked_s,
            suspicions=[nothing] * verdicts,
            processes={"diagnosis": process} if ran else {},
        )
    ).doubts
    assert [doubt.startswith("the diagnosis reached no verdict") for doubt in doubts] == [True] * told
