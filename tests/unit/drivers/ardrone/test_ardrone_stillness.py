"""Whether a drone stands still and level, by its attitude and gyros."""

import math

from drivers.ardrone.convert import NavdataMotion
from drivers.ardrone.stillness import Stillness

MS = 1_000_000


def motion(pitch_deg=0.0, rate_deg_s=0.1, force=None):
    rates = (0.0, math.radians(rate_deg_s), 0.0)
    return NavdataMotion((0.0, 0.0, 0.0), math.radians(0.5), math.radians(pitch_deg), 0.0, None, rates, force)


def test_a_second_level_and_quiet_is_still_and_a_swinging_hand_never_is():
    still, swung = Stillness(), Stillness()
    for i in range(2000):
        still.update(i * 5 * MS, motion(2.9))
        phase = i * 0.005 * math.tau / 3
        swung.update(i * 5 * MS, motion(25 * math.sin(phase), 25 * math.tau / 3 * math.cos(phase)))
        assert still.stands is (i >= 200) and not swung.stands
    still.update(2000 * 5 * MS, motion(2.9, rate_deg_s=20))
    assert not still.stands
    still.update(2400 * 5 * MS, motion(2.9))
    assert not still.stands, "nor at once after it"


def test_a_drone_that_was_trimmed_at_a_slant_is_level_by_gravity():
    still = Stillness()
    for i in range(300):
        still.update(i * 5 * MS, motion(-12.0, force=(0.3, -0.2, 9.7)))
    assert still.stands
    for i in range(300, 600):
        still.update(i * 5 * MS, motion(-12.0, force=(2.0, 0.0, 9.6)))
    assert not still.stands
