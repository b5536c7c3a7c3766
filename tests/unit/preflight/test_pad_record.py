"""Medians of the fixed cameras' observations of drones on the ground."""

import numpy as np
import pytest

from groundstation.bus.messages import Header, RelativeObservation
from groundstation.preflight.pad_record import LEAST, PadRecord

MS = 1_000_000


def sighting(at_ns: int, x_m: float, yaw_rad: float | None, observer: str = "ceiling") -> RelativeObservation:
    rows = 3 if yaw_rad is None else 4
    return RelativeObservation(
        header=Header(at_ns, "clock", observer, observer, 1),
        observer=observer,
        subject="drone_1",
        camera=observer,
        position_m=(x_m, 0.0, 4.0),
        yaw_rad=yaw_rad,
        covariance=tuple(np.eye(rows).ravel().tolist()),
    )


def test_single_wild_sightings_do_not_move_a_median() -> None:
    record = PadRecord(("ceiling",))
    for i in range(20):
        record.see(sighting(i, 9.0 if i % 7 == 0 else 0.5, 3.14 if i % 2 else -3.14), i * 60 * MS)
    (median,) = record.medians(20 * 60 * MS)
    assert median.position_m[0] == 0.5
    assert abs(abs(median.yaw_rad) - np.pi) < 0.01, "headings are not averaged across the turn"


def test_few_old_and_onboard_sightings_make_no_median() -> None:
    record = PadRecord(("ceiling",))
    for i in range(LEAST - 1):
        record.see(sighting(i, 0.5, None), i * 60 * MS)
    for i in range(20):
        record.see(sighting(i, 0.5, None, "drone_2"), i * 60 * MS)
    assert record.medians(1000 * MS) == ()
    record.see(sighting(99, 0.5, None), 1000 * MS)
    (median,) = record.medians(1000 * MS)
    assert np.isnan(median.yaw_rad)
    assert record.medians(60_000 * MS) == ()


@pytest.mark.parametrize("name", ["drone_1"])
def test_a_drone_that_flew_begins_anew(name: str) -> None:
    record = PadRecord(("ceiling",))
    for i in range(20):
        record.see(sighting(i, 0.5, 0.0), i * 60 * MS)
    record.forget(name)
    assert record.medians(1200 * MS) == ()
