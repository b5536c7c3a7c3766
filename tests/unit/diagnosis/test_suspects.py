"""A stretch of flight identifies the wrong setting with its size, and none if all are right."""

import math
from dataclasses import replace

import numpy as np
import pytest
from swinging_lab import CLOCK, Lab

from groundstation.calibration.flown import Flown
from groundstation.calibration.team_batch import Fit, TeamBatch
from groundstation.calibration.team_causes import evidence
from groundstation.calibration.team_figures import Suspicion
from groundstation.calibration.team_record import team_record
from groundstation.diagnosis import suspects
from groundstation.diagnosis.suspects import Charge, Verdict, is_told, verdict_on, weighed
from groundstation.field.resolved import ResolvedField
from sim_bridge.study.wrong_figures import WrongFigures

SURVEYED = np.array([0.003, 0.003, 0.006])


def suspicions() -> tuple[Suspicion, ...]:
    columns = np.eye(3)
    single = [Suspicion(name, "print", columns[:, [i]], np.array([0.08])) for i, name in enumerate("ab")]
    both = Suspicion("", "print", columns[:, [0]] + columns[:, [1]], np.array([0.08]))
    return (*single, both, Suspicion("c", "delay", columns[:, [2]], np.array([0.08])))


def told(verdict: Verdict) -> list[tuple[Charge, ...]]:
    return [charges for charges in verdict.causes if is_told(charges[0])]


SLOW = (pytest.mark.slow, pytest.mark.study)


@pytest.mark.parametrize(
    ("errors", "suspect", "size"),
    [
        ({}, None, 0.0),
        pytest.param({("ceiling", "delay"): 50.0}, ("ceiling", "delay"), 0.05, marks=SLOW),
        pytest.param({("drone_1", "delay"): -50.0}, ("drone_1", "delay"), -0.05, marks=SLOW),
        pytest.param({("drone_1", "own_delay"): 80.0}, ("drone_1", "own_delay"), 0.08, marks=SLOW),
        ({("drone_1", "pan"): 3.0, ("drone_2", "pan"): 3.0}, ("", "pan"), math.radians(3.0)),
        pytest.param({("ceiling", "pitch"): 3.0}, ("ceiling", "tilted"), math.radians(3.0), marks=SLOW),
        pytest.param({("turtlebot", "print"): 0.05}, ("turtlebot", "print"), 0.05, marks=SLOW),
        pytest.param({("drone_1", "focal"): 0.04}, ("drone_1", "focal"), 0.04, marks=(*SLOW, pytest.mark.exhaustive)),
    ],
)
def test_a_wrong_figure_is_likeliest_with_its_size(
    lab_field: ResolvedField, errors: dict[tuple[str, str], float], suspect: tuple[str, str] | None, size: float
) -> None:
    verdict = verdict_on(Lab(lab_field, WrongFigures(errors), seconds=16.0).flown(), lab_field)
    assert verdict is not None
    assert [charges[0].suspect for charges in verdict.causes] == ([] if suspect is None else [suspect])
    for charges in verdict.causes:
        assert charges[0].size == pytest.approx(size, rel=0.25)
        assert charges[0].std < 0.25 * abs(size)


def test_exchanged_drones_are_no_figure(lab_field: ResolvedField) -> None:
    """A drone's marker was called 12 % smaller."""
    other = dict(zip(lab_field.drones, reversed(lab_field.drones), strict=True))
    exchanged = WrongFigures({}, exchanged=other)
    verdict = verdict_on(Lab(lab_field, exchanged, seconds=16.0).flown(), lab_field)
    assert verdict is not None and verdict.is_unexplained and verdict.causes == ()


def test_two_causes_are_told_apart_and_what_is_too_small_is_not_told() -> None:
    H = np.diag([1e6, 1e6, 1e6])
    two = weighed(H, H @ np.array([0.05, 0.0, 0.06]), SURVEYED, suspicions())
    assert {charges[0].suspect for charges in told(two)} == {("a", "print"), ("c", "delay")}
    small = weighed(H, H @ np.array([0.015, 0.0, 0.02]), SURVEYED, suspicions())
    assert told(small) == []
    assert small.leads[("a", "print")] > math.log(100.0), "sure, and yet not worth telling"


@pytest.mark.parametrize(("part", "sizes"), [("delay", (0.042, 0.06)), ("velocity_delay", (0.06,))])
def test_a_late_velocity_is_told_on_the_evidence_that_a_calibration_asks_for(
    part: str, sizes: tuple[float, ...]
) -> None:
    """42 ms lead by e^6.6 here, 60 ms by e^15: enough to report a picture delay, not a velocity delay."""
    H, one = np.diag([1.5e4]), Suspicion("a", part, np.eye(1), np.array([0.06]))
    found = []
    for size in (0.042, 0.06):
        verdict = weighed(H, H @ np.array([size]), np.array([0.006]), (one,))
        assert size == 0.06 or math.log(100.0) < verdict.leads["a", part] < math.log(1e4)
        found += [size] if told(verdict) else []
    assert tuple(found) == sizes


def test_equally_likely_causes_are_named_together() -> None:
    direction = np.array([1.0, 1.0, 0.0])
    H = 1e6 * np.outer(direction, direction)
    (charges,) = weighed(H, H @ np.array([0.05, 0.0, 0.0]), SURVEYED, suspicions()).causes
    assert {one.suspect for one in charges} == {("a", "print"), ("b", "print"), ("", "print")}


@pytest.mark.slow
@pytest.mark.study
def test_a_charge_stands_only_where_the_paths_that_fit_without_it_explain_the_flight_worse(
    lab_field: ResolvedField, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Eight seconds into a flight joined in the air, a linear model alone blamed a right camera for a 64 ms error."""
    flown = Lab(lab_field, WrongFigures({("ceiling", "delay"): 50.0})).flown()
    (charges,) = verdict_on(flown, lab_field).causes  # type: ignore[union-attr]
    assert charges[0].lead > math.log(100.0)
    whole = Fit.log_evidence
    monkeypatch.setattr(Fit, "log_evidence", lambda fit, sigma: 1e-3 * whole(fit, sigma))
    verdict = verdict_on(flown, lab_field)
    assert verdict is not None
    assert verdict.causes == () and verdict.leads["ceiling", "delay"] < math.log(3.0), (
        "refuted where it was told before"
    )


def test_a_charge_must_lead_with_knots_elsewhere_too(lab_field: ResolvedField, monkeypatch: pytest.MonkeyPatch) -> None:
    flown = Lab(lab_field, WrongFigures({("drone_1", "delay"): -50.0})).flown()
    monkeypatch.setattr(suspects, "_confirmed", lambda charges, *_: [replace(one, lead=1.0) for one in charges])
    verdict = verdict_on(flown, lab_field)
    assert verdict is not None and verdict.causes == ()
    assert verdict.leads["drone_1", "delay"] == 1.0, "refuted, had it been told before"


def test_of_small_errors_the_evidence_of_two_fits_is_that_of_their_linear_model(lab_field: ResolvedField) -> None:
    batch = TeamBatch(
        team_record(Lab(lab_field, WrongFigures({("turtlebot", "print"): 0.03})).flown(), lab_field), lab_field
    )
    narrow, place = np.diag(batch.figures.surveyed**2), batch.figures.place["turtlebot", "print"]
    wide = narrow.copy()
    wide[place, place] = 0.08**2
    without, with_ = batch.fit(narrow), batch.fit(wide)
    gain = with_.log_evidence(wide) - without.log_evidence(narrow)
    H, g = with_.information, with_.pull
    assert gain == pytest.approx(evidence(H, g, wide) - evidence(H, g, narrow), rel=0.15)


def test_a_flight_that_no_fixed_camera_saw_has_no_verdict(lab_field: ResolvedField) -> None:
    flown = Lab(lab_field, WrongFigures({})).flown()
    blind = tuple((now, tuple(p for p in inputs if p[0] != "observation")) for now, inputs in flown.ticks)
    assert verdict_on(Flown(blind, CLOCK), lab_field) is None
