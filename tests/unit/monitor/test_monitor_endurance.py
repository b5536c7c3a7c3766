"""How long a battery is good for: by its kind at first, then by the mean drain of this flight."""

import pytest

from groundstation.bus.messages import FlightState, Header, VehicleStatus
from groundstation.monitor.endurance import Endurance, TakeOff, endurance, flies, take_off_of

MIN = 60_000_000_000


def status(battery: float | None, flight_state: FlightState = FlightState.FLYING) -> VehicleStatus:
    header = Header(0, "here", "drone_1", "drone_1", 1)
    return VehicleStatus(header=header, flight_state=flight_state, mode="TRACK", battery=battery)


@pytest.mark.parametrize(
    ("take_off", "expected"),
    [
        (None, Endurance(6.0, False)),
        (TakeOff(9 * MIN, 0.66), Endurance(6.0, False)),  # not two points are spent
        (TakeOff(9 * MIN + 40_000_000_000, 0.8), Endurance(6.0, False)),  # not half a minute has passed
        (TakeOff(8 * MIN, 0.85), Endurance(5.0, True)),  # ten points a minute, fifty are left
    ],
)
def test_a_drain_is_believed_once_enough_is_spent(take_off: TakeOff | None, expected: Endurance) -> None:
    said = endurance(10 * MIN, 0.65, 0.15, take_off, 720.0)
    assert said is not None and said.measured is expected.measured
    assert said.minutes == pytest.approx(expected.minutes)


def test_nobody_knows_where_the_kind_does_not_say_and_nothing_is_spent() -> None:
    assert endurance(10 * MIN, 0.65, 0.15, None, None) is None


def test_below_the_limit_nothing_is_left() -> None:
    said = endurance(10 * MIN, 0.13, 0.15, None, 720.0)
    assert said == Endurance(0.0, False) and said.words == "< 1 min"


@pytest.mark.parametrize(("said", "words"), [(Endurance(6.9, False), "~6 min"), (Endurance(1.0, True), "1 min")])
def test_a_figure_by_the_kind_is_marked(said: Endurance, words: str) -> None:
    assert said.words == words


def test_a_take_off_lasts_until_the_drone_stands() -> None:
    first = take_off_of(None, 1 * MIN, status(0.8))
    assert first == TakeOff(1 * MIN, 0.8)
    assert take_off_of(first, 2 * MIN, status(0.7)) == first
    assert take_off_of(first, 2 * MIN, status(0.7, FlightState.LANDED)) is None
    assert take_off_of(first, 2 * MIN, status(None)) is None


def test_a_drone_that_is_not_heard_for_a_moment_has_not_landed() -> None:
    first, lost = TakeOff(1 * MIN, 0.8), status(0.7, FlightState.LOST)
    assert take_off_of(first, 2 * MIN, lost) == first and flies(lost, first)
    assert take_off_of(None, 2 * MIN, lost) is None and not flies(lost, None)
    assert take_off_of(first, 0, lost) is None


def test_a_fuller_battery_or_a_jump_back_in_a_replay_begins_anew() -> None:
    first = TakeOff(5 * MIN, 0.5)
    assert take_off_of(first, 6 * MIN, status(0.9)) == TakeOff(6 * MIN, 0.9)
    assert take_off_of(first, 1 * MIN, status(0.4)) == TakeOff(1 * MIN, 0.4)
