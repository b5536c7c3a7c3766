"""Requests with delayed answers."""

import pytest

from drivers.mavlink.requests import Requests, word_of
from drivers.mavlink.wire.flight import CommandAckMessage
from drivers.mavlink.wire.names import MavCmd, MavResult

S = 1_000_000_000


def test_a_vehicle_that_works_at_a_request_is_not_reported_for_its_silence() -> None:
    requests = Requests(1)
    requests.ask(0, "arming", MavCmd.COMPONENT_ARM_DISARM, 1.0)
    for turn in range(60):
        requests.due(turn * S // 10)
        if turn % 10 == 3:
            working = CommandAckMessage(MavCmd.COMPONENT_ARM_DISARM, MavResult.IN_PROGRESS)
            requests.answer(turn * S // 10, working)
    assert not requests.failures
    requests.answer(6 * S, CommandAckMessage(MavCmd.COMPONENT_ARM_DISARM, MavResult.ACCEPTED))
    assert "arming" in requests.accepted


def test_one_that_falls_silent_over_it_is_asked_again_and_then_reported() -> None:
    requests, sent = Requests(1), list[int]()
    requests.ask(0, "landing", MavCmd.NAV_LAND)
    for turn in range(60):
        sent += [turn] * len(requests.due(turn * S // 10))
        if turn == 13:
            requests.answer(turn * S // 10, CommandAckMessage(MavCmd.NAV_LAND, MavResult.IN_PROGRESS))
    assert sent == [0, 5, 10, 18, 23, 28] and list(requests.failures) == ["landing: no answer"]


def mode_asked() -> Requests:
    requests = Requests(1)
    requests.ask(0, "guided mode", MavCmd.DO_SET_MODE, 1.0, 6.0)
    requests.due(0)
    return requests


def mode_answer(result: MavResult) -> CommandAckMessage:
    return CommandAckMessage(MavCmd.DO_SET_MODE, result)


@pytest.mark.parametrize("accepted_first", [True, False])
@pytest.mark.parametrize("result", [MavResult.TEMPORARILY_REJECTED, MavResult.DENIED, MavResult.FAILED])
def test_of_two_answers_to_a_mode_order_the_refusal_counts(result: MavResult, accepted_first: bool) -> None:
    requests, answers = mode_asked(), [MavResult.ACCEPTED, result]
    for answer in answers if accepted_first else reversed(answers):
        requests.answer(S // 100, mode_answer(answer))
    assert not requests.accepted
    assert list(requests.failures) == [f"guided mode: {word_of(result)}"]
    requests.ask(S, "guided mode", MavCmd.DO_SET_MODE, 1.0, 6.0)
    assert not requests.due(S)
    requests.ask(2 * S, "guided mode", MavCmd.DO_SET_MODE, 1.0, 6.0)
    assert requests.due(2 * S)


def test_two_accepted_answers_are_one() -> None:
    requests = mode_asked()
    for _ in range(2):
        requests.answer(S // 100, mode_answer(MavResult.ACCEPTED))
    assert requests.accepted == {"guided mode"} and not requests.failures


def test_a_refusal_after_the_heartbeat_told_of_the_mode_means_nothing() -> None:
    requests = mode_asked()
    requests.answer(S // 100, mode_answer(MavResult.ACCEPTED))
    requests.drop("guided mode")
    requests.answer(S // 50, mode_answer(MavResult.TEMPORARILY_REJECTED))
    assert requests.accepted == {"guided mode"} and not requests.failures


def test_a_late_refusal_does_not_take_back_an_accepted_mode() -> None:
    requests = mode_asked()
    requests.answer(S // 100, mode_answer(MavResult.ACCEPTED))
    requests.answer(2 * S, mode_answer(MavResult.TEMPORARILY_REJECTED))
    assert requests.accepted == {"guided mode"} and not requests.failures


def test_a_refused_repetition_of_another_order_does_not_take_back_its_acceptance() -> None:
    requests = Requests(1)
    requests.ask(0, "take-off", MavCmd.NAV_TAKEOFF)
    requests.due(0)
    requests.answer(S // 100, CommandAckMessage(MavCmd.NAV_TAKEOFF, MavResult.ACCEPTED))
    requests.answer(S // 50, CommandAckMessage(MavCmd.NAV_TAKEOFF, MavResult.FAILED))
    assert requests.accepted == {"take-off"} and not requests.failures
