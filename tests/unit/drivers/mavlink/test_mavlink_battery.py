"""The charge that counts: the lower of two fresh ones, or none where the autopilot judges the battery critical."""

import pytest

from drivers.mavlink.battery import Batteries
from drivers.mavlink.wire.telemetry import BatteryStatus
from groundstation.time_units import NS_PER_S

S = NS_PER_S


def status(percent: int, state: int = 1) -> BatteryStatus:
    return BatteryStatus(0, 1, 1, 32767, (3300,) * 10, -1, 0, -1, percent, 0, state)


@pytest.mark.parametrize("state", range(8))
def test_an_ardupilots_battery_that_it_judges_critical_is_empty(state) -> None:
    known = Batteries().with_lowest(S, 100).with_first(S, status(100, state))
    assert known.charge(S) == (0.0 if state in (3, 4, 5) else 1.0)
    assert known.with_lowest(11 * S, 100).charge(11 * S) == 1.0, "an old judgement is none"


def test_a_critical_battery_of_unknown_charge_is_empty_too() -> None:
    assert Batteries().with_first(S, status(-1, 3)).charge(S) == 0.0
    assert Batteries().with_first(S, status(-1, 1)).charge(S) is None


def test_of_two_packs_the_lower_counts_in_whatever_order_they_are_told() -> None:
    known, charges = Batteries(), set()
    for turn in range(1, 21):
        known = known.with_lowest(turn * S, 9) if turn % 2 else known.with_first(turn * S, status(60))
        charges.add(known.charge(turn * S))
    assert charges == {0.09}
    assert Batteries().with_first(S, status(9)).with_lowest(S, 60).charge(S) == 0.09


def test_a_charge_that_is_told_no_more_counts_for_ten_seconds() -> None:
    known = Batteries().with_lowest(S, 9).with_first(5 * S, status(60))
    assert known.charge(11 * S - 1) == 0.09 and known.charge(11 * S) == 0.6 and known.charge(15 * S) is None
    unknown = known.with_lowest(10 * S, -1).with_first(10 * S, status(-1))
    assert unknown.charge(11 * S) == 0.6, "-1: the charge of a moment ago holds"
    assert Batteries().with_lowest(S, 120).charge(S) == 1.0


def test_each_worse_judgement_is_told_once() -> None:
    known, told = Batteries(), []
    for state in (1, 1, 2, 2, 3, 3, 4, 2, 1, 5):
        told.append(known.news(status(50, state)))
        known = known.with_first(S, status(50, state))
    words = ["", "", "is low", "", "is critical", "", "is all but empty", "", "", "has failed"]
    assert all(word in text if word else not text for word, text in zip(words, told, strict=True))
