"""From verdicts to notices: each suspicion is reported once, and withdrawn once."""

import math

import pytest

from groundstation.bus.messages import Severity
from groundstation.diagnosis.suspects import Charge, Suspect, Verdict
from groundstation.diagnosis.watch import FigureWatch
from groundstation.field.resolved import ResolvedField

S = 1_000_000_000
PAN, LENS = ("drone_1", "pan"), ("drone_1", "focal")


def charge(suspect: Suspect, size: float, lead: float = 9.0) -> Charge:
    return Charge(suspect, size, 0.2 * abs(size), lead)


def verdict(*causes: tuple[Charge, ...], **leads: float) -> Verdict:
    told = {one.suspect: one.lead for charges in causes for one in charges}
    return Verdict(causes, told or {PAN: leads.get("pan", 0.0)})


def test_a_suspicion_is_told_once_and_stands_until_it_is_refuted(lab_field: ResolvedField) -> None:
    watch, wrong = FigureWatch(lab_field), verdict((charge(PAN, math.radians(3.0)),))
    (told,) = watch.take(wrong, S)
    assert (told.severity, told.entity) == (Severity.WARNING, "drone_1")
    assert told.text.startswith("drone_1's camera looks 3.0 +- 0.6 deg farther to the left than the field says")
    assert watch.take(wrong, 6 * S) == []
    assert watch.take(verdict(pan=2.0), 11 * S) == [] and watch.cause.startswith("drone_1's camera")
    (figure,) = watch.figures
    assert (figure.entity, figure.told_ns, figure.remedy) == ("drone_1", S, told.remedy)
    (refuted,) = watch.take(verdict(pan=0.5), 16 * S)
    assert refuted.severity is Severity.INFO and "no longer suspected" in refuted.text
    assert watch.cause == "" and watch.figures == ()


def test_what_no_figure_explains_is_told_once_and_replaces_suspicions(lab_field: ResolvedField) -> None:
    watch, unexplained = FigureWatch(lab_field), Verdict((), {}, is_unexplained=True)
    watch.take(verdict((charge(PAN, math.radians(3.0)),)), S)
    told, refuted = watch.take(unexplained, 6 * S)
    assert told.severity is Severity.WARNING and "video stream" in told.remedy
    assert told.text == "the team's sightings disagree, and no single wrong figure explains it" == watch.cause
    assert refuted.text.startswith("drone_1's camera") and "no longer suspected" in refuted.text
    assert watch.take(unexplained, 11 * S) == [] and watch.figures[0].told_ns == 6 * S
    (over,) = watch.take(verdict(), 16 * S)
    assert over.severity is Severity.INFO and over.text.endswith("no longer so") and watch.figures == ()


def test_each_figure_keeps_its_own_name_while_its_size_changes(lab_field: ResolvedField) -> None:
    watch = FigureWatch(lab_field)
    watch.take(verdict((charge(PAN, 0.05),), (charge(LENS, 0.03),)), S)
    before = [figure.about for figure in watch.figures]
    watch.take(verdict((charge(LENS, 0.04),), (charge(PAN, 0.06),)), 6 * S)
    assert before == ["drone_1 pan", "drone_1 focal"] and [figure.about for figure in watch.figures] == before[::-1]


def test_a_suspicion_beside_one_that_is_told_again_stands_until_it_is_refuted(lab_field: ResolvedField) -> None:
    watch, pan, lens = FigureWatch(lab_field), charge(PAN, 0.05), charge(LENS, 0.03)
    assert len(watch.take(verdict((pan,), (lens,)), S)) == 2
    assert watch.take(Verdict(((pan,),), {PAN: 9.0, LENS: 4.4}), 6 * S) == []
    assert [figure.about for figure in watch.figures] == ["drone_1 pan", "drone_1 focal"]
    assert watch.take(verdict((pan,), (lens,)), 11 * S) == [], "told already"
    (refuted,) = watch.take(Verdict(((pan,),), {PAN: 9.0, LENS: 0.5}), 16 * S)
    assert "focal length" in refuted.text and "no longer suspected" in refuted.text
    assert [figure.about for figure in watch.figures] == ["drone_1 pan"]


def test_a_suspicion_that_another_one_replaces_is_withdrawn(lab_field: ResolvedField) -> None:
    """Both explain the same sightings, so that the lead of the former stays large."""
    watch = FigureWatch(lab_field)
    watch.take(verdict((charge(PAN, 0.05),)), S)
    told, withdrawn = watch.take(Verdict(((charge(LENS, 0.03),),), {PAN: 7.0, LENS: 9.0}), 6 * S)
    assert told.severity is Severity.WARNING and "focal length" in told.text
    assert withdrawn.severity is Severity.INFO and "no longer suspected" in withdrawn.text
    assert [figure.about for figure in watch.figures] == ["drone_1 focal"]


def test_of_two_that_cannot_be_told_apart_the_likelier_comes_first(lab_field: ResolvedField) -> None:
    watch = FigureWatch(lab_field)
    (told,) = watch.take(verdict((charge(LENS, 0.03), charge(PAN, 0.05, 8.0))), S)
    assert told.text.index("focal length") < told.text.index("farther to the left")
    assert "which of them it is cannot be told yet" in told.text and "; or " in told.remedy
    (narrowed,) = watch.take(verdict((charge(LENS, 0.03),)), 6 * S)
    assert "farther" not in narrowed.text and watch.cause in narrowed.text


@pytest.mark.parametrize(
    ("suspect", "size", "words", "remedy"),
    [
        (("", "print"), 0.05, "all markers are 5.0 +- 1.0 % larger than the field says", "ruler"),
        (("", "pan"), -0.05, "every drone's camera looks 2.9 +- 0.6 deg farther to the right", "pan_left_deg: "),
        (
            ("drone_2", "tilt"),
            0.05,
            "drone_2's camera looks 2.9 +- 0.6 deg lower",
            "drones.drone_2.camera.tilt_down_deg",
        ),
        (("drone_2", "up"), -0.04, "drone_2's camera sits 4 +- 1 cm lower", "drones.drone_2.camera.position_m: ["),
        (("ceiling", "delay"), 0.05, "ceiling's pictures are 50 +- 10 ms older than configured", "calibrate delay"),
        (("drone_1", "delay"), -0.05, "the pictures of drone_1's camera are 50 +- 10 ms newer", "calibrate delay"),
        (("", "delay"), 0.05, "the pictures of every drone's camera are 50 +- 10 ms older", "calibrate delay"),
        (
            ("drone_1", "own_delay"),
            0.06,
            "drone_1's telemetry is 60 +- 12 ms older than its stamps say",
            "the clock of",
        ),
        (("drone_1", "velocity_delay"), 0.06, "drone_1's velocities are 60 +- 12 ms older", "calibrate delay"),
        (("drone_1", "scale"), 0.2, "drone_1's true velocities are 20.0 +- 4.0 % larger", "calibrate team"),
        (("drone_1", "focal"), -0.03, "drone_1's camera has a focal length 3.0 +- 0.6 % shorter", "calibrate the lens"),
        (("", "focal"), 0.03, "every drone's camera has a focal length 3.0 +- 0.6 % longer", "lens of each drone"),
        (
            ("ceiling", "aside"),
            0.2,
            "the camera ceiling hangs 20 +- 4 cm to the side of where the field puts it",
            "extrinsics",
        ),
        (("ceiling", "z"), 0.1, "the camera ceiling hangs 10 +- 2 cm higher than the field says", "extrinsics"),
        (
            ("ceiling", "yaw"),
            0.1,
            "the camera ceiling is turned by 5.7 +- 1.1 deg counter-clockwise (seen from above)",
            "extrinsics",
        ),
        (
            ("ceiling", "tilted"),
            0.1,
            "the camera ceiling is tilted by 5.7 +- 1.1 deg compared with the field",
            "extrinsics",
        ),
    ],
)
def test_each_suspect_has_a_sentence_and_a_remedy(
    lab_field: ResolvedField, suspect: Suspect, size: float, words: str, remedy: str
) -> None:
    (told,) = FigureWatch(lab_field).take(verdict((charge(suspect, size),)), S)
    assert words in told.text and remedy in told.remedy
