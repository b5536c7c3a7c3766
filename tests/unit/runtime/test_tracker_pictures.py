"""Claims of a picture about its time and camera are checked before use."""

import math

import pytest
from hovering_team import TARGET, Flight
from msgspec import structs

from groundstation.bus.messages import ClockOffset, SearchedPicture, Verdict
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


def searched(flight: Flight, observer: str, age_ms: int, *found: str, clock: str = "here") -> SearchedPicture:
    header = flight.header(observer, age_ms, clock)
    return SearchedPicture(header=header, observer=observer, camera=f"{observer}_camera", found=found)


def overlooked(flight: Flight) -> float:
    """Return the chance that all pictures would have missed the target, where that is least."""
    flight.run(0.02, onboard=False)
    room = flight.tracker.lookout.targets["turtlebot"].room
    assert room is not None
    return float(room.overlooked.min())


def test_a_searched_picture_counts_once_and_not_when_it_is_old(tracking: Flight) -> None:
    """Ten copies of one picture made it nearly certain that the target is not there."""
    tracking.run(1.5, onboard=False)
    picture = searched(tracking, "drone_1", 40)
    assert tracking.ingest(picture) is None
    once = overlooked(tracking)
    assert 0.1 < once < 0.5
    assert {tracking.ingest(picture) for _ in range(10)} == {Verdict.DUPLICATE}
    assert tracking.ingest(searched(tracking, "drone_1", 1000)) is Verdict.LATE
    assert overlooked(tracking) == once
    assert tracking.tracker.rejected == {"SearchedPicture DUPLICATE": 10, "SearchedPicture LATE": 1}
    assert tracking.ingest(searched(tracking, "drone_1", 990)) is None


def test_copies_of_one_picture_raise_no_doubt_about_a_drone(tracking: Flight) -> None:
    tracking.run(0.8, look=False)
    picture = searched(tracking, "ceiling", 40)
    for _ in range(6):
        tracking.ingest(picture)
    tracking.run(0.02, look=False)
    assert tracking.tracker.lookout.missed_s == {}


def test_pictures_of_a_drone_that_is_not_where_it_is_believed_do_not_count(tracking: Flight) -> None:
    tracking.unseen = {"drone_1"}
    for _ in range(30):
        tracking.run(0.1, onboard=False)
        tracking.ingest(searched(tracking, "ceiling", 40, "drone_2"))
    assert set(tracking.tracker.lookout.missed_s) == {"drone_1"}
    before = overlooked(tracking)
    tracking.ingest(searched(tracking, "drone_1", 40))
    assert overlooked(tracking) == before
    tracking.ingest(searched(tracking, "drone_2", 40))
    assert overlooked(tracking) < 0.7 * before


@pytest.mark.parametrize("sign", ["none", "pictures of another clock", "sightings"])
def test_a_drone_searches_whose_camera_shows_that_it_works(tracking: Flight, sign: str) -> None:
    """A picture of another host's clock fills no map, but the sightings of that camera count."""
    offset = ClockOffset(header=tracking.header("run"), of="there", offset_ns=0)
    assert tracking.ingest(offset) is None
    for tick in range(40):
        tracking.run(0.1, onboard=False)
        tracking.ingest(searched(tracking, "drone_2", 40))
        if sign == "sightings":
            seen = structs.replace(tracking.onboard("drone_1"), subject="drone_2") if tick % 10 == 0 else None
            if seen is not None:
                tracking.ingest(seen)
        elif sign != "none":
            tracking.ingest(searched(tracking, "drone_1", 40, clock="there"))
        tracking.tracker.setpoints(tracking.now)
    belief = tracking.tracker.belief
    stands = tracking.tracker.lookout.stands(("drone_1", "drone_2"), ("turtlebot",), belief)
    assert set(stands) == ({"drone_2"} if sign == "none" else {"drone_1", "drone_2"})


def test_observations_belong_to_their_drone_whatever_camera_they_name(tracking: Flight) -> None:
    tracking.corrections.clear()
    for _ in range(10):
        tracking.run(0.02, look=False, onboard=False)
        assert tracking.ingest(tracking.onboard("drone_1", camera="ceiling")) is None, "not refused as the ceiling's"
    tracking.run(0.1, look=False, onboard=False)
    assert {(c.observer, c.verdict) for c in tracking.corrections} == {("drone_1", Verdict.ACCEPTED)}
    assert math.dist(tracking.tracker.belief.mean_of("turtlebot")[:2], TARGET[:2]) < 0.05
