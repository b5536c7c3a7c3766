"""Remaining flight time of a battery: at first by its kind, then increasingly by this flight's drain."""

from itertools import pairwise

import pytest

from groundstation.bus.messages import FlightState, Header, VehicleStatus
from groundstation.monitor.endurance import Endurance, TakeOff, endurance, flies, may_fly, take_off_of

MIN = 60_000_000_000


def status(battery: float | None, flight_state: FlightState = FlightState.FLYING, mode: str = "TRACK") -> VehicleStatus:
    header = Header(0, "here", "drone_1", "drone_1", 1)
    return VehicleStatus(header=header, flight_state=flight_state, mode=mode, battery=battery)


def test_a_drain_counts_for_as_much_as_has_been_flown() -> None:
    by_kind = endurance(10 * MIN, 0.65, 0.15, None, 720.0)
    assert by_kind is not None and by_kind.minutes == pytest.approx(6.0)
    said = endurance(10 * MIN, 0.65, 0.15, TakeOff(8 * MIN, 0.85), 720.0)  # ten points a minute
    assert said is not None and said.minutes == pytest.approx(0.5 * 3.0 / (1.0 / 12.0 + 0.2))
    said = endurance(60 * MIN, 0.65, 0.15, TakeOff(10 * MIN, 0.75), 720.0)  # a fifth of a point a minute
    assert said is not None and said.minutes == pytest.approx(0.5 * 51.0 / (1.0 / 12.0 + 0.1))


def test_a_charge_that_drops_at_once_is_no_drain_before_half_a_minute_has_passed() -> None:
    for seconds, minutes in ((1, 1.56), (30, 1.56), (60, 0.13 * 2.0 / (1.0 / 12.0 + 0.32))):
        said = endurance(seconds * MIN // 60, 0.28, 0.15, TakeOff(0, 0.6), 720.0)
        assert said is not None and said.minutes == pytest.approx(minutes)


@pytest.mark.parametrize("drain_per_min", [0.04, 0.0833, 0.2])
def test_a_figure_never_jumps(drain_per_min: float) -> None:
    """A battery reports whole points, twice a second here: the figure changes by an eighth at most at once."""
    minutes = []
    for half_seconds in range(180):
        level = round(0.9 - drain_per_min * half_seconds / 120.0, 2)
        said = endurance(half_seconds * MIN // 120, level, 0.15, TakeOff(0, 0.9), 720.0)
        assert said is not None
        minutes.append(said.minutes)
    assert all(abs(now - before) < 0.12 * before for before, now in pairwise(minutes))


@pytest.mark.parametrize(
    ("take_off", "minutes"),
    [
        (None, None),
        (TakeOff(9 * MIN, 0.66), None),  # less than two points are spent
        (TakeOff(9 * MIN + 40_000_000_000, 0.8), None),  # less than half a minute has passed
        (TakeOff(8 * MIN, 0.85), 5.0),  # ten points a minute, fifty are left
    ],
)
def test_where_the_kind_does_not_say_only_what_is_spent_tells(take_off: TakeOff | None, minutes: float | None) -> None:
    said = endurance(10 * MIN, 0.65, 0.15, take_off, None)
    assert (None if said is None else pytest.approx(said.minutes)) == minutes


def test_below_the_limit_nothing_is_left() -> None:
    said = endurance(10 * MIN, 0.13, 0.15, None, 720.0)
    assert said == Endurance(0.0) and said.words == "< 1 min"
    assert Endurance(6.9).words == "~6 min"


def test_a_take_off_lasts_until_the_drone_stands() -> None:
    first = take_off_of(None, 1 * MIN, status(0.8))
    assert first == TakeOff(1 * MIN, 0.8)
    assert take_off_of(first, 2 * MIN, status(0.7)) == first
    assert take_off_of(first, 2 * MIN, status(0.7, FlightState.LANDED)) is None
    unknown = take_off_of(first, 2 * MIN, status(None))
    assert unknown == first, "an unknown charge is no landing"
    begun = take_off_of(None, 1 * MIN, status(None))
    assert begun == TakeOff(1 * MIN, None) and endurance(2 * MIN, 0.7, 0.15, begun, None) is None
    assert take_off_of(begun, 2 * MIN, status(0.8)) == TakeOff(2 * MIN, 0.8)


def test_a_drone_that_is_not_heard_for_a_moment_has_not_landed() -> None:
    first, lost = TakeOff(1 * MIN, 0.8), status(0.7, FlightState.LOST)
    assert take_off_of(first, 2 * MIN, lost) == first and flies(lost, first)
    assert take_off_of(None, 2 * MIN, lost) is None and flies(lost, None), "its driver had it in the air"
    restarted = status(0.7, FlightState.LOST, "CONNECTING")
    assert flies(restarted, first) and not flies(restarted, None) and may_fly(restarted, None)
    for mode in ("LANDED", "CUT"):
        down = status(0.7, FlightState.LOST, mode)
        assert take_off_of(first, 2 * MIN, down) is None and not flies(down, first) and not may_fly(down, first)
    assert take_off_of(first, 0, lost) is None


def test_a_fuller_battery_or_a_jump_back_in_a_replay_begins_anew() -> None:
    first = TakeOff(5 * MIN, 0.5)
    assert take_off_of(first, 6 * MIN, status(0.9)) == TakeOff(6 * MIN, 0.9)
    assert take_off_of(first, 1 * MIN, status(0.4)) == TakeOff(1 * MIN, 0.4)
