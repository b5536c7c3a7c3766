"""Notices of joining and of relocation; a robot relocated again soon is not flown on for some seconds."""

import pytest

from groundstation.bus.messages import Severity, Verdict
from groundstation.control.joinings import Joinings
from groundstation.estimation.measurement import Correction
from groundstation.time_units import NS_PER_S


def joining(again: bool, subject: str = "drone_1") -> Correction:
    nis = 900.0 if again else None
    return Correction("ceiling", subject, Verdict.ACCEPTED, "", nis=nis, joined=True)


def after(times_s: list[float], now_s: float, again: bool = True) -> bool:
    watch = Joinings()
    for at_s in times_s:
        watch.take(round(at_s * NS_PER_S), [joining(again)])
    watch.take(round(now_s * NS_PER_S), [])
    assert not watch.is_unsettled("drone_2")
    return watch.is_unsettled("drone_1")


def test_joining_is_told_and_being_put_elsewhere_is_warned_of() -> None:
    first, second = Joinings().take(1, [joining(again=False), joining(again=True)])
    assert (first.severity, first.text) == (Severity.INFO, "drone_1 localised by ceiling")
    assert (second.severity, second.text) == (Severity.WARNING, "drone_1 re-initialised by ceiling")


def test_a_sighting_that_joins_nobody_is_not_told() -> None:
    assert Joinings().take(1, [Correction("ceiling", "drone_1", Verdict.ACCEPTED, "", nis=3.0)]) == []


def test_initialisations_by_ranges_are_reported_and_count_as_unsettled() -> None:
    watch = Joinings()
    first, second = watch.take(1, [], [("uwb", "drone_1", False), ("uwb", "drone_1", True)])
    assert (first.severity, first.text) == (Severity.INFO, "drone_1 localised by uwb")
    assert (second.severity, second.text) == (Severity.WARNING, "drone_1 re-initialised by uwb")
    assert not watch.is_unsettled("drone_1")
    watch.take(2 * NS_PER_S, [joining(again=True)])
    assert watch.is_unsettled("drone_1"), "a camera and ranges contradict each other"


def test_nobody_is_unsettled_before_anything_was_seen() -> None:
    assert not Joinings().is_unsettled("drone_1")


SECOND_AND_NOW = [(5.9, 5.9, True), (6.0, 6.0, False), (2.0, 4.9, True), (2.0, 5.0, False)]


@pytest.mark.parametrize(("second_s", "now_s", "unsettled"), SECOND_AND_NOW)
def test_twice_within_five_seconds_is_unsettled_for_three(second_s: float, now_s: float, unsettled: bool) -> None:
    assert after([1.0, second_s], now_s) is unsettled


def test_once_is_not_unsettled() -> None:
    assert after([1.0], 1.0) is False


def test_joining_anew_is_no_sign_of_a_wrong_sensor() -> None:
    assert after([1.0, 2.0], 2.0, again=False) is False
