"""Requests with delayed answers."""

from drivers.mavlink.requests import Requests
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
