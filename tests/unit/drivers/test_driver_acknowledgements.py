"""A driver's record of answered commands, and the time at which it calls one effective."""

import pytest

from drivers.acknowledgements import AckBook
from drivers.watchdog_types import Ack, DriverMode, VehicleView
from groundstation.bus.messages import AckStage, Command, FlightState, Header, Verb


def command(name: str, verb: Verb = Verb.LAND) -> Command:
    return Command(header=Header(1, "clock", "drone_1", "op", 0), id=name, verb=verb, scope=(), issuer="op")


def view(state: FlightState, fresh: bool = True) -> VehicleView:
    return VehicleView(state, fresh)


def test_an_answer_is_remembered_and_given_again() -> None:
    book = AckBook()
    assert book.answered(command("a")) is None
    accepted = book.answer(command("a"), "")
    refused = book.answer(command("b", Verb.TAKEOFF), "the battery is low")
    assert accepted == Ack("a", Verb.LAND, AckStage.ACCEPTED, "")
    assert refused == Ack("b", Verb.TAKEOFF, AckStage.REFUSED, "the battery is low")
    assert (book.answered(command("a")), book.answered(command("b"))) == (accepted, refused)


def test_the_last_256_are_remembered() -> None:
    book = AckBook()
    for number in range(256):
        book.answer(command(str(number)), "no")
    assert book.answered(command("0")) is not None
    book.answer(command("256"), "no")
    assert book.answered(command("0")) is None
    assert all(book.answered(command(str(number))) is not None for number in range(1, 257))


def test_an_effective_command_is_reported_once_and_remembered() -> None:
    book = AckBook()
    book.answer(command("a"), "")
    assert book.effective(DriverMode.LANDING, view(FlightState.FLYING), flies=False) == ()
    done = (Ack("a", Verb.LAND, AckStage.EFFECTIVE),)
    assert book.effective(DriverMode.LANDED, view(FlightState.LANDED), flies=False) == done
    assert book.effective(DriverMode.LANDED, view(FlightState.LANDED), flies=False) == ()
    assert book.answered(command("a")) == done[0]


def test_of_two_equal_commands_both_become_effective() -> None:
    """Two operators order LAND before the touchdown; the first one's shell said that it was not confirmed."""
    book = AckBook()
    book.answer(command("other", Verb.HOLD), "")
    book.answer(command("a"), "")
    book.answer(command("b"), "")
    told = book.effective(DriverMode.LANDED, view(FlightState.LANDED), flies=False)
    assert told == (Ack("a", Verb.LAND, AckStage.EFFECTIVE), Ack("b", Verb.LAND, AckStage.EFFECTIVE))
    assert (book.answered(command("a")), book.answered(command("b"))) == told
    assert book.effective(DriverMode.LANDED, view(FlightState.LANDED), flies=False) == ()


def test_a_refused_one_is_not_waited_for_and_does_not_end_the_wait_for_another() -> None:
    book = AckBook()
    book.answer(command("a"), "")
    book.answer(command("b", Verb.TRACK), "not now")
    (told,) = book.effective(DriverMode.LANDED, view(FlightState.LANDED), flies=True)
    assert told.command_id == "a"


@pytest.mark.parametrize(
    ("verb", "mode", "state", "flies", "effective"),
    [
        (Verb.TAKEOFF, DriverMode.HOVER, FlightState.HOVERING, False, True),
        (Verb.TAKEOFF, DriverMode.TRACK, FlightState.FLYING, False, True),
        (Verb.TAKEOFF, DriverMode.HOVER, FlightState.TAKING_OFF, False, False),
        (Verb.TAKEOFF, DriverMode.TAKING_OFF, FlightState.HOVERING, False, False),
        (Verb.TRACK, DriverMode.TRACK, FlightState.FLYING, True, True),
        (Verb.TRACK, DriverMode.TRACK, FlightState.FLYING, False, False),
        (Verb.RESUME, DriverMode.TRACK, FlightState.FLYING, True, True),
        (Verb.RESUME, DriverMode.TRACK, FlightState.FLYING, False, False),
        (Verb.HOLD, DriverMode.HOLD, FlightState.HOVERING, False, True),
        (Verb.HOLD, DriverMode.LANDED, FlightState.LANDED, False, True),
        (Verb.HOLD, DriverMode.HOLD, FlightState.FLYING, False, False),
        (Verb.HOLD, DriverMode.HOVER, FlightState.HOVERING, False, False),
        (Verb.LAND, DriverMode.LANDING, FlightState.LANDED, False, True),
        (Verb.LAND, DriverMode.LANDED, FlightState.LANDING, False, False),
        (Verb.CUT_MOTORS, DriverMode.CUT, FlightState.EMERGENCY, False, True),
        (Verb.CUT_MOTORS, DriverMode.CUT, FlightState.LANDED, False, True),
        (Verb.CUT_MOTORS, DriverMode.CUT, FlightState.FLYING, False, False),
    ],
)
def test_a_command_is_effective_once_the_vehicle_shows_it(
    verb: Verb, mode: DriverMode, state: FlightState, flies: bool, effective: bool
) -> None:
    book = AckBook()
    book.answer(command("a", verb), "")
    assert bool(book.effective(mode, view(state), flies)) is effective


@pytest.mark.parametrize("verb", [Verb.LAND, Verb.CUT_MOTORS, Verb.TAKEOFF, Verb.HOLD])
def test_the_last_telemetry_of_a_silent_vehicle_confirms_no_command(verb: Verb) -> None:
    book = AckBook()
    book.answer(command("a", verb), "")
    for state in FlightState:
        assert book.effective(DriverMode.HOLD, view(state, fresh=False), flies=False) == ()


@pytest.mark.parametrize(
    ("verb", "mode", "kept"),
    [
        (Verb.TRACK, DriverMode.LANDING, False),
        (Verb.TAKEOFF, DriverMode.CUT, False),
        (Verb.TRACK, DriverMode.HOLD, True),
        (Verb.LAND, DriverMode.LANDING, True),
        (Verb.CUT_MOTORS, DriverMode.CUT, True),
    ],
)
def test_commands_to_move_are_forgotten_in_landing_and_cut(verb: Verb, mode: DriverMode, kept: bool) -> None:
    book = AckBook()
    book.enter(mode)
    book.answer(command("a", verb), "")
    book.enter(mode)
    told = [
        *book.effective(DriverMode.TRACK, view(FlightState.FLYING), flies=True),
        *book.effective(DriverMode.CUT, view(FlightState.LANDED), flies=True),
    ]
    assert bool(told) is kept
