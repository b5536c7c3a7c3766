"""The rules for the sender to a drone, at their limits; over time they are proved in test_somebody_speaks.py."""

from dataclasses import replace

import pytest

from groundstation.process.heartbeat import SlotState
from groundstation.supervisor.silence import (
    DriverSigns,
    FailsafeCommand,
    Guard,
    SupervisorSigns,
    command_at,
    silent_since,
)

MS = 1_000_000
S = 1_000 * MS
NOW = 100 * S
FRESH = SupervisorSigns(NOW)
DRIVES = DriverSigns(SlotState.READY, NOW, worked=True)


def ago(ms: int) -> DriverSigns:
    return replace(DRIVES, beat_ns=NOW - ms * MS)


@pytest.mark.parametrize(
    ("signs", "before", "since"),
    [
        (ago(399), 0, 0),
        (ago(399), 7, 0),
        (ago(400), 0, NOW - 400 * MS),
        (ago(400), 7, 7),
        (replace(ago(10), gone=True), 0, NOW - 10 * MS),
        (replace(ago(10), gone=True), 7, 7),
        (replace(ago(900), ended=True, state=SlotState.STOPPING), 7, 0),  # it has landed its drone
        (replace(ago(10), state=SlotState.STOPPING), 0, NOW - 10 * MS),  # it crashed
        (replace(ago(900), state=SlotState.STARTING, worked=False), 0, 0),  # it never flew
        (replace(ago(10), state=SlotState.STARTING, worked=False), 7, 7),  # restarted: it has no message yet
        (replace(ago(10), state=SlotState.STOPPING, worked=False, ended=True), 7, 7),  # it never met the drone
        (DriverSigns(), 7, 7),
        (replace(ago(10), state=SlotState.DEGRADED), 7, 0),
    ],
)
def test_since_when_a_drone_is_without_its_driver(signs: DriverSigns, before: int, since: int) -> None:
    assert silent_since(signs, before, NOW, 0, 400 * MS) == since


def test_silence_counts_only_while_somebody_was_awake_to_hear() -> None:
    assert silent_since(ago(5_000), 0, NOW, NOW - 399 * MS, 400 * MS) == 0
    assert silent_since(ago(5_000), 0, NOW, NOW - 400 * MS, 400 * MS) == NOW - 5 * S
    assert silent_since(ago(5_000), 7, NOW, NOW, 400 * MS) == 7, "another has heard it"


def test_hover_then_land() -> None:
    assert command_at(0, NOW, 3.0) is FailsafeCommand.NONE
    assert command_at(NOW - 3 * S + 1, NOW, 3.0) is FailsafeCommand.HOVER
    assert command_at(NOW - 3 * S, NOW, 3.0) is FailsafeCommand.LAND


def words(supervisor: SupervisorSigns, signs: DriverSigns, before: int = 0) -> tuple[FailsafeCommand, bool]:
    decision = Guard(3.0, 10.0).step(NOW, signs, before, supervisor, 0)
    return decision.command, decision.kill


def test_the_supervisor_goes_before_the_guardian() -> None:
    for signs in (ago(0), ago(449), replace(DRIVES, gone=True)):
        assert words(FRESH, signs) == (FailsafeCommand.NONE, False)
    assert words(FRESH, ago(5_000), before=NOW - 5 * S) == (FailsafeCommand.NONE, False)
    assert words(FRESH, ago(450)) == (FailsafeCommand.HOVER, False), "it is overdue: it has just woken up"


@pytest.mark.parametrize("supervisor", [replace(FRESH, beat_ns=NOW - 300 * MS), replace(FRESH, alive=False)])
def test_the_guardian_speaks_when_both_are_silent(supervisor: SupervisorSigns) -> None:
    assert words(supervisor, ago(299)) == (FailsafeCommand.NONE, False)
    assert words(supervisor, ago(300)) == (FailsafeCommand.HOVER, False)
    assert words(supervisor, ago(799)) == (FailsafeCommand.HOVER, False)
    assert words(supervisor, ago(800)) == (FailsafeCommand.HOVER, True)
    assert words(supervisor, replace(ago(10), gone=True)) == (FailsafeCommand.HOVER, False)
    assert words(supervisor, ago(5_000)) == (FailsafeCommand.LAND, True)
    assert words(supervisor, replace(ago(5_000), gone=True)) == (FailsafeCommand.LAND, False)


def test_lands_when_a_living_driver_would_have_landed() -> None:
    """A dead supervisor for 1 s, a frozen one for 3 s: a driver that dies then was landing already."""
    dies = replace(ago(10), gone=True)
    for silence_ms, alive, word in ((999, False, "HOVER"), (1_000, False, "LAND"), (2_999, True, "HOVER")):
        assert words(SupervisorSigns(NOW - silence_ms * MS, alive), dies)[0].name == word
    assert words(SupervisorSigns(NOW - 3 * S), dies)[0] is FailsafeCommand.LAND
    late = ago(350)
    assert words(SupervisorSigns(NOW - 3 * S), late) == (FailsafeCommand.LAND, True), "ended before it takes LAND back"


def test_during_the_stop_the_guardian_lands_after_a_second_and_kills_nobody() -> None:
    stops = replace(FRESH, stops=True)
    assert words(stops, ago(299)) == (FailsafeCommand.NONE, False)
    assert words(stops, ago(900)) == (FailsafeCommand.HOVER, False)
    assert words(stops, ago(1_000)) == (FailsafeCommand.LAND, False)
    assert words(stops, ago(1_000), before=NOW - S) == (FailsafeCommand.HOVER, False), "as the supervisor began"


def test_settled_once_nobody_drives_or_land_was_said_for_long_enough() -> None:
    dead = replace(FRESH, alive=False)
    guard = Guard(3.0, 10.0)

    def settled(after_s: float, signs: DriverSigns) -> bool:
        now_ns = NOW + round(after_s * S)
        return guard.step(now_ns, signs, 0, dead, 0).settled

    assert settled(0, replace(ago(0), ended=True)) and settled(0, DriverSigns())
    assert not settled(0, ago(0)), "it may die yet"
    gone = replace(ago(0), gone=True)
    assert not settled(0.5, gone) and not settled(1.0, gone)
    assert not settled(10.9, gone) and settled(11.0, gone)
