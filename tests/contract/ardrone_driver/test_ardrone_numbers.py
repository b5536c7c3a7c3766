"""A drone that obeys the higher numbers: of another program, or of those that spoke before this driver started."""

import socket
import time

import pytest

from groundstation.bus.messages import AckStage, Verb
from groundstation.bus.topics import COMMAND_ACK

FLY, EMERGENCY = 1 << 0, 1 << 31
LAND, START = "290717696", "290718208"


class Stranger:
    """Another program: commands the drone with numbers far above ours, once between any two turns of the driver."""

    def __init__(self, rig, reference) -> None:
        self.drone, self.reference, self.number, self.speaks = rig.fake, reference, 2_000_000, True
        self._udp = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._turn = rig.turn
        rig.turn = self._speak

    def _speak(self, *arguments) -> None:
        if self.speaks:
            lines = f"AT*REF={self.number},{self.reference}\rAT*PCMD={self.number + 1},1,0,0,0,0\r"
            self._udp.sendto(lines.encode(), (self.drone.address, 5556))
            self.number += 2
        self._turn(*arguments)

    def close(self) -> None:
        self._udp.close()


@pytest.fixture
def stranger_on():
    strangers = []

    def appear(rig, reference):
        strangers.append(Stranger(rig, reference))
        return strangers[-1]

    yield appear
    for stranger in strangers:
        stranger.close()


def told(rig):
    return [notice.text for notice in rig.drone.news()]


@pytest.mark.parametrize(("verb", "heeded"), [(Verb.LAND, LAND), (Verb.CUT_MOTORS, "290717952")])
def test_stops_are_obeyed_though_another_program_sends_higher_numbers(rig, stranger_on, verb, heeded):
    rig.take_off()
    stranger_on(rig, START)
    rig.turn(), rig.turn()
    rig.fake.heeded.clear()
    rig.order(verb)
    rig.until(lambda: ("REF", heeded) in rig.fake.heeded, 1.0)
    assert verb is Verb.LAND or rig.fake.state & EMERGENCY


def test_another_program_is_told_and_keeps_the_drone_from_taking_off_until_it_is_gone(rig, stranger_on):
    rig.connect()
    told(rig)
    stranger = stranger_on(rig, LAND)
    rig.until(lambda: rig.drone.view(time.monotonic_ns()).not_ready == "another program commands it", 2.0)
    assert [text for text in told(rig) if "it obeys commands that are not ours" in text]
    rig.order(Verb.TAKEOFF)
    rig.turn()
    ack = rig.messages(COMMAND_ACK)[-1]
    assert ack.stage is AckStage.REFUSED and "another program commands it" in ack.reason
    assert "another program" in rig.drone.health(time.monotonic_ns()).detail
    stranger.speaks = False
    rig.until(lambda: not rig.drone.view(time.monotonic_ns()).not_ready, 8.0)
    assert told(rig) == ["no other program commands it any more"]


def test_a_flying_drone_whose_first_command_is_lost_is_landed_whatever_numbers_it_has_heard(rig):
    rig.fake.state, rig.fake.major = FLY, 4
    rig.fake.number = rig.fake.moved_by = 500_000
    rig.fake.loses = 1
    rig.until(lambda: not rig.fake.state & FLY, 3.0)
