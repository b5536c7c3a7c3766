"""Printing faults of markers, distinguished from chance."""

from drivers.camera.faults import MarkerFaults
from groundstation.time_units import NS_PER_S


def test_a_code_that_is_misread_now_and_then_is_not_taken_for_a_marker() -> None:
    faults = MarkerFaults()
    for minute in range(20):
        faults.foreign(9, 60 * minute * NS_PER_S, ())
    assert not faults.take()
