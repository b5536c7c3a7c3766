"""A stop cancels earlier start commands, by the clock of their sender."""

import pytest

from groundstation.bus.messages import Command, Header, Verb
from groundstation.bus.stop_mark import StopMark


def stop(stamp_ns: int, clock: str = "boot-1") -> Command:
    return Command(header=Header(stamp_ns, clock, "team", "console", 1), id="s", verb=Verb.HOLD, scope=(), issuer="ann")


@pytest.mark.parametrize(
    ("stamp_ns", "clock", "given_ns"), [(900, "boot-1", 900), (1100, "boot-1", 1000), (5, "x", 1000)]
)
def test_a_stop_is_as_old_as_its_stamp_unless_that_is_of_another_clock_or_to_come(
    stamp_ns: int, clock: str, given_ns: int
) -> None:
    assert StopMark.of(stop(stamp_ns, clock), 1000, "boot-1").given_ns == given_ns


def test_it_overtakes_what_was_given_before_it_and_nothing_else() -> None:
    mark = StopMark.of(stop(900), 1000, "boot-1")
    assert [mark.overtakes(start_ns) for start_ns in (899, 900, 901)] == [True, False, False]
    assert mark.words == "HOLD by ann came after it"
