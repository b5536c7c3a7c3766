"""Claims of a picture about its time and camera are checked before use."""

import math

import pytest
from hovering_team import TARGET, Flight

from groundstation.bus.messages import SearchedPicture, Verdict
from groundstation.field.resolved import ResolvedField


@pytest.fixture
def tracking(lab_field: ResolvedField) -> Flight:
    flight = Flight(lab_field)
    flight.fly("drone_1", "drone_2")
    flight.run(1.0)
    return flight


def test_a_picture_from_the_future_keeps_nobody_from_searching(tracking: Flight) -> None:
    header, camera = tracking.header("drone_1", age_ms=-60_000), "drone_1_camera"
    shown = SearchedPicture(header=header, observer="drone_1", camera=camera, found=("turtlebot",))
    assert tracking.ingest(shown) is Verdict.IMPLAUSIBLE
    tracking.run(4.0, onboard=False)
    assert tracking.tracker.lookout.missing == ("turtlebot",)


def test_observations_belong_to_their_drone_whatever_camera_they_name(tracking: Flight) -> None:
    tracking.corrections.clear()
    for _ in range(10):
        tracking.run(0.02, look=False, onboard=False)
        assert tracking.ingest(tracking.onboard("drone_1", camera="ceiling")) is None, "not refused as the ceiling's"
    tracking.run(0.1, look=False, onboard=False)
    assert {(c.observer, c.verdict) for c in tracking.corrections} == {("drone_1", Verdict.ACCEPTED)}
    assert math.dist(tracking.tracker.belief.mean_of("turtlebot")[:2], TARGET[:2]) < 0.05
