"""Observations used from a recording: only those of entities whose odometry covers that time."""

import numpy as np
import pytest

from groundstation.calibration.team_record import OwnMotion, Sightings, TeamRecord

SECONDS = 10.0
NONE_SEEN = Sightings(np.empty(0), (), (), np.empty((0, 4)), np.empty((0, 4, 4)), np.empty((0, 4)))


def motion(times: np.ndarray, resets: np.ndarray | None = None) -> OwnMotion:
    still = np.zeros(len(times))
    jumps = still if resets is None else resets
    return OwnMotion(times, np.zeros((len(times), 2)), still, still, still, still, jumps, still, still)


def record(own: OwnMotion) -> TeamRecord:
    return TeamRecord({"drone_1": own}, NONE_SEEN, {}, SECONDS)


@pytest.mark.parametrize(
    ("at_s", "shown"), [(-0.3, False), (0.0, False), (0.1, False), (0.2, True), (5.0, True), (9.8, True), (9.9, False)]
)
def test_a_sighting_older_than_the_first_odometry_does_not_count(at_s: float, shown: bool) -> None:
    known = record(motion(np.arange(0.0, SECONDS, 0.01)))
    assert known.shows(("ceiling", "drone_1"), at_s) == shown
    assert known.shows(("ceiling", "turtlebot"), at_s) == shown, "nor do paths reach it"


@pytest.mark.parametrize(("silent_s", "shown"), [(0.2, True), (0.5, False)])
def test_a_sighting_in_a_silence_of_the_odometry_does_not_count(silent_s: float, shown: bool) -> None:
    times = np.arange(0.0, SECONDS, 0.01)
    known = record(motion(times[(times < 5.0) | (times > 5.0 + silent_s)]))
    assert known.shows(("ceiling", "drone_1"), 5.1) == shown
    assert known.shows(("ceiling", "drone_1"), 5.9)


def test_a_sighting_about_a_jump_of_the_heading_does_not_count() -> None:
    times = np.arange(0.0, SECONDS, 0.01)
    known = record(motion(times, (times > 5.0).astype(float)))
    assert [known.shows(("drone_1", "turtlebot"), at_s) for at_s in (4.5, 4.8, 5.2, 5.5)] == [True, False, False, True]
