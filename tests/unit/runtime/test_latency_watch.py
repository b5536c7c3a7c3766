"""Operator warnings of a wrong camera latency: from the diagnosis's evidence, until refuted."""

import pytest

from groundstation.bus.messages import Severity
from groundstation.estimation.camera_latency import Lateness
from groundstation.field.resolved import ResolvedField
from groundstation.runtime.latency_watch import PictureAge


@pytest.mark.parametrize(
    ("offset_s", "std_s", "told"),
    [
        # Three deviations are worth 25 to 1 with so little data: a drone's late telemetry blamed the ceiling camera.
        (-0.071, 0.022, False),
        (-0.090, 0.022, True),
        (0.040, 0.006, True),
        (0.020, 0.006, False),
        (0.014, 0.002, False),  # certain, and harmless
    ],
)
def test_a_wrong_age_is_told_by_100_to_1(
    lab_field: ResolvedField, monkeypatch: pytest.MonkeyPatch, offset_s: float, std_s: float, told: bool
) -> None:
    age = PictureAge(lab_field, "clock")
    monkeypatch.setattr(age._watch, "told", lambda: (Lateness("ceiling", offset_s, std_s),))
    warned = [one for one in age.notices() if one.severity is Severity.WARNING]
    assert bool(warned) is told
    assert age.notices() == [], "once"
