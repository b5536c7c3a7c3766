"""Check of markers at lift-off: the right one rose, another one rose, or not yet known."""

import numpy as np
import pytest

from groundstation.bus.memory_bus import MemoryBus, MemoryExchange
from groundstation.bus.messages import FlightState, RelativeObservation, VehicleStatus
from groundstation.bus.topics import OBSERVATION, VEHICLE_STATUS
from groundstation.geometry.rotations import world_from_downward_optical
from groundstation.runtime.lift_off import LiftOffWatch, is_seen_in_flight, why_unseen
from groundstation.runtime.marker_height import FixedCamera, MarkerHeight
from groundstation.runtime.team import Member, TeamStatus

MS = 1_000_000
S = 1_000_000_000
NOW = 1000 * S
Said = tuple[FlightState, float | None, float | None]
UP, CLIMBS, STANDS = FlightState.HOVERING, FlightState.TAKING_OFF, FlightState.LANDED


def member(
    state: FlightState, reported_m: float | None = None, rise_m: float | None = 0.0, now_ns: int = NOW
) -> Member:
    """Return a drone that stood at 0.12 m; rise_m None: its marker is out of view."""
    made = Member(state=state, heard_ns=now_ns, floor_m=0.12, height_m=reported_m, measured_ns=now_ns)
    if rise_m is not None:
        for age in (200, 130, 60):
            made.marker.see(now_ns - age * MS, 0.12 + rise_m)
    return made


@pytest.mark.parametrize(
    ("state", "reported_m", "rise_m", "seen"),
    [
        (UP, 0.8, 0.8, True),
        (UP, 0.8, 0.5, True),  # over the edge of its pad, late sightings
        (UP, 0.8, 0.3, False),
        (UP, 0.8, 0.0, False),
        (UP, 0.8, None, False),
        (UP, 2.0, 0.8, False),
        (UP, 0.3, 0.1, False),
        (UP, None, 0.36, True),  # an autopilot, at the lowest take-off height of a field
        (UP, None, 0.1, False),
        (CLIMBS, 0.6, 0.6, False),
    ],
)
def test_seen_in_flight_is_the_own_marker_risen_to_where_the_drone_says_that_it_is(
    state: FlightState, reported_m: float | None, rise_m: float | None, seen: bool
) -> None:
    assert is_seen_in_flight(member(state, reported_m, rise_m), NOW) is seen


def test_a_drone_that_was_not_seen_is_left_out_for_what_was_seen() -> None:
    assert why_unseen(member(UP, 0.8, None), NOW, 10) == "it flies, but no fixed camera has seen it for 10 s"
    assert why_unseen(member(UP, 2.0, 0.8), NOW, 10) == "it reports 2.0 m, but its marker rose by 0.8 m"
    assert why_unseen(member(UP, None, 0.1), NOW, 10) == "it flies, but its marker rose by 0.1 m"


def watched(seconds: float, one: Said, two: Said, watch: LiftOffWatch | None = None) -> tuple[str, float]:
    """Return (output of drone_1's watch, time [s]); each drone: state, reported height, rise."""
    watch = watch or LiftOffWatch()
    for number in range(round(seconds * 20) + 1):
        now_ns = NOW + number * 50 * MS
        members = {"drone_1": member(*one, now_ns=now_ns), "drone_2": member(*two, now_ns=now_ns)}
        mistake = watch.step(now_ns, "drone_1", members)
        if mistake is not None:
            assert "drone_1" in mistake.remedy
            return mistake.text, number / 20
    return "", seconds


@pytest.mark.parametrize(
    ("one", "says"),
    [
        ((UP, 0.9, 0.0), "drone_1 reports 0.9 m but its marker is on the floor and"),
        ((CLIMBS, 0.5, 0.02), "drone_1 reports 0.5 m but its marker is on the floor and"),
        ((UP, 0.9, None), "drone_1 reports 0.9 m but its marker is out of view and"),
        ((UP, None, 0.0), "drone_1 says that it flies but its marker is on the floor and"),
    ],
)
@pytest.mark.parametrize("other", [STANDS, FlightState.EMERGENCY, FlightState.UNKNOWN])
def test_a_standing_drone_whose_marker_rises_instead_is_named_at_once(
    one: tuple, says: str, other: FlightState
) -> None:
    text, after_s = watched(5, one, (other, None, 0.7))
    assert text == f"{says} drone_2's marker rose: the addresses or markers of the two are probably exchanged"
    assert after_s == 0.5


@pytest.mark.parametrize(
    ("reported_m", "says", "limit_s"), [(0.8, "drone_1 reports 0.8 m", 3.0), (None, "drone_1 says that it flies", 5.0)]
)
def test_a_marker_that_stays_down_alone_is_named_in_a_few_seconds(
    reported_m: float | None, says: str, limit_s: float
) -> None:
    text, after_s = watched(8, (UP, reported_m, 0.01), (STANDS, None, 0.0))
    assert text.startswith(f"{says} but its marker is on the floor and no other rose: its address or marker is")
    assert after_s == limit_s


@pytest.mark.parametrize(
    ("one", "two"),
    [
        ((UP, 0.8, 0.8), (STANDS, None, 0.0)),
        ((UP, 0.8, 0.8), (STANDS, None, 0.7)),  # a person carries the other one
        ((UP, 2.5, 0.8), (STANDS, None, 0.7)),  # an echo: it is left out for it, nobody is exchanged
        ((UP, 0.8, None), (STANDS, None, 0.0)),  # no camera: it lands because it is not observed
        ((UP, 0.8, None), (UP, 0.8, 0.8)),
        ((UP, 0.8, None), (FlightState.LANDING, 0.5, 0.5)),  # left out just before
        ((UP, 0.8, None), (FlightState.LOST, None, 0.8)),
        ((CLIMBS, None, 0.0), (STANDS, None, 0.0)),  # an autopilot spools up
        ((CLIMBS, 0.1, 0.0), (STANDS, None, 0.0)),
        ((STANDS, None, 0.0), (STANDS, None, 0.7)),
    ],
)
def test_no_false_alarm(one: tuple, two: tuple) -> None:
    assert watched(30, one, two) == ("", 30)


def test_an_autopilot_may_take_its_time_from_free_skids_to_a_visible_climb() -> None:
    watch = LiftOffWatch()
    for seconds, rise_m in ((4.9, 0.05), (0.1, 0.3), (4.9, 0.2), (1.0, 0.6)):
        assert watched(seconds, (UP, None, rise_m), (STANDS, None, 0.0), watch)[0] == ""


def test_the_height_of_a_marker_is_the_median_of_its_last_sightings() -> None:
    height = MarkerHeight()
    for number, height_m in enumerate((0.1, 0.1, 0.8)):
        assert height.at(NOW + number) is None
        height.see(NOW + number, height_m)
    assert height.at(NOW + 2) == 0.1
    height.see(NOW + 3, 0.8)
    height.see(NOW + 4, 0.8)
    assert height.at(NOW + 4) == 0.8
    assert height.at(NOW + 2 * S + 4) is None, "out of view"
    height.see(NOW + 3 * S, 0.8)
    height.forget()
    assert height.at(NOW + 3 * S) is None


def test_a_camera_that_hangs_askew_measures_heights_all_the_same() -> None:
    place, turned = np.array([1.0, -0.5, 4.2]), world_from_downward_optical((4.0, -7.0, 30.0))
    seen = turned.T @ (np.array([-0.6, 1.1, 0.9]) - place)
    right, down, forward = turned[2].tolist()
    assert FixedCamera(4.2, (right, down, forward)).height_of((seen[0], seen[1], seen[2])) == pytest.approx(0.9)


def test_where_a_drone_was_seen_in_flight_says_nothing_of_it_once_it_has_landed() -> None:
    exchange = MemoryExchange()
    drone, ceiling = MemoryBus(exchange, "lab", "drone_1"), MemoryBus(exchange, "lab", "ceiling")
    cameras = {"ceiling": FixedCamera(4.2, (0.0, 0.0, -1.0))}
    team = TeamStatus(MemoryBus(exchange, "lab", "supervisor"), ("drone_1",), cameras)

    def rise_m(state: FlightState) -> float | None:
        header = drone.header("drone_1")
        drone.publish(VEHICLE_STATUS, VehicleStatus(header=header, flight_state=state, mode="HOVER"))
        team.update(NOW)
        return team.members["drone_1"].rise_m(NOW)

    for _ in range(3):
        sighting = RelativeObservation(
            header=ceiling.header("ceiling"), observer="ceiling", subject="drone_1", camera="ceiling",
            position_m=(0.3, 0.1, 3.3), yaw_rad=None, covariance=(1.0, 0, 0, 0, 1.0, 0, 0, 0, 1.0),
        )  # fmt: skip
        ceiling.publish(OBSERVATION, sighting)
    assert rise_m(UP) == pytest.approx(0.8)
    assert rise_m(STANDS) is None
