"""Means of an AR.Drone's telemetry between two turns, and values that are no measurement."""

import pytest

from drivers.ardrone.averages import MotionMean
from drivers.ardrone.convert import NavdataMotion


@pytest.mark.parametrize(("values", "repeats"), [((0.1, 0.2, 0.3, 0.4), False), ((0.1, 0.0, 0.0, 0.0, 0.0), True)])
def test_a_velocity_that_stands_still_is_no_measurement(values, repeats):
    mean = MotionMean()
    for left in values:
        mean.add(NavdataMotion((left + 1.0, left, 0.0), 0.0, 0.0, 0.0, None, None, None))
    assert mean.repeats is repeats


@pytest.mark.parametrize(
    ("forces", "frozen"),
    [([0.1, 0.2, 0.2, 0.2], False), ([0.1, 0.2, 0.2, 0.2, 0.2], True), ([0.2] * 4 + [0.1], False), ([None] * 4, True)],
)
def test_accelerometers_that_stand_still_or_tell_nothing_are_old(forces, frozen):
    mean = MotionMean()
    for force in forces:
        told = None if force is None else (0.0, force, 9.8)
        mean.add(NavdataMotion((0.0, 0.0, 0.0), 0.0, 0.0, 0.0, None, None, told))
    assert mean.frozen is frozen
