"""A vehicle's shortfall at a steady setpoint: learnt at the stated rate, limited, not while the setpoint changes."""

import math

import pytest

from drivers.mavlink.drift import DriftFeedback
from drivers.mavlink.undershoot import Undershoot
from groundstation.bus.messages import EntityEstimate

S = 1_000_000_000
STEP_S = 0.02


def learnt(seen, seconds, asked=lambda at_s: (0.4, 0.0), first_s=0.0):
    """Return the learnt shortfall after each step, for a vehicle at rest with setpoint and observation every 20 ms."""
    undershoot, missing = Undershoot(), []
    undershoot.note_command(100 * S, (0.0, 0.0))
    for step in range(1, round(seconds / STEP_S) + 1):
        at_s = step * STEP_S
        undershoot.note_command(round((100.0 + at_s) * S), asked(at_s))
        if at_s > first_s:
            undershoot.take(round((100.0 + at_s) * S), seen(at_s))
        missing.append(undershoot.missing)
    return missing


def test_an_error_of_a_steady_command_is_learnt_by_seven_tenths_of_it_a_second():
    missing = learnt(lambda at_s: (0.3, -0.2), 4.0, first_s=3.0)
    (x, y), (x_before, y_before) = missing[-1], missing[-26]
    assert (x - x_before) / 0.5 == pytest.approx(0.7 * 0.1, rel=0.05)
    assert (y - y_before) / 0.5 == pytest.approx(0.7 * 0.2, rel=0.05)


def test_it_is_limited_whatever_its_direction():
    x, y = learnt(lambda at_s: (-2.0, -1.0), 10.0)[-1]
    assert math.hypot(x, y) == pytest.approx(0.25)
    assert y > 0.0 and x > y


def test_nothing_is_learnt_while_a_vehicle_still_follows_a_step():
    """After 0.6 s ln 4 the expected velocity is within 0.1 m/s of the command."""
    missing = learnt(lambda at_s: (0.0, 0.0), 1.5)
    begins_s = STEP_S * next(step for step, (x, _) in enumerate(missing, 1) if x > 0.0)
    assert begins_s == pytest.approx(0.6 * math.log(4.0), abs=0.05)


def test_a_pause_of_sightings_is_no_time_to_learn_in():
    undershoot = Undershoot()
    for step in range(1, 251):
        undershoot.note_command(100 * S + round(step * STEP_S * S), (0.4, 0.0))
    undershoot.take(105 * S, (0.3, 0.0))
    undershoot.take(155 * S, (0.3, 0.0))
    assert undershoot.missing[0] == pytest.approx(2 * 0.7 * 0.1 * 0.1, rel=0.1)


def test_on_the_floor_it_is_forgotten():
    feedback = DriftFeedback()
    slow = EntityEstimate("v", "robot", (0.0, 0.0, 0.8, 0.0), (1e-4,) * 16, (0.2, 0.0, 0.0), True, 0.1)
    for step in range(1, 251):
        feedback.note_command(100 * S + round(step * STEP_S * S), (0.4, 0.0, 0.0))
        feedback.take(100 * S + round(step * STEP_S * S), slow, (0.2, 0.0, 0.0))
    assert feedback.correction(105 * S)[0] > 0.2
    feedback.reset()
    feedback.take(105 * S, slow, (0.2, 0.0, 0.0))
    assert feedback.correction(105 * S) == pytest.approx((0.0, 0.0, 0.0), abs=0.02)
