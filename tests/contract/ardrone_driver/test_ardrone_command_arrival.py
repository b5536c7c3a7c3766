"""A command is executed at once, not at the driver's next turn."""

import time

import pytest

from drivers.host import run_hosts, sleep_serving
from groundstation.bus import clock
from groundstation.bus.messages import OPERATOR, Command, Verb
from groundstation.bus.topics import COMMAND

S = 1_000_000_000


def test_a_stop_is_obeyed_when_it_comes_and_a_flood_of_orders_sends_no_flood(rig):
    rig.take_off()
    now_ns = rig.host._turned_ns
    rig.order(Verb.HOLD)
    assert rig.host.due_ns() > now_ns + 9_000_000
    assert rig.host.due_ns() <= now_ns + 10_000_000
    rig.until(lambda: rig.decision.mode == "HOLD")
    assert rig.host.due_ns() > now_ns + S


def test_a_command_goes_out_when_it_comes_and_not_at_the_next_turn(rig):
    rig.take_off()
    woken: list[int] = []
    slept: list[int] = []
    rig.process.wake = lambda: woken.append(len(slept))

    def sleep_until(deadline_ns):
        slept.append(deadline_ns)
        if len(slept) == 2:
            raise InterruptedError
        time.sleep(0.011)
        rig.order(Verb.HOLD)
        return True

    rig.process.sleep_until = sleep_until
    with pytest.raises(InterruptedError):
        run_hosts(rig.process, [rig.host], rate_hz=1.0)
    assert woken == [1] and slept[0] == slept[1], "the turn that was due has not come yet"
    assert rig.host.watchdog.mode == "HOLD"


def test_a_command_that_comes_just_after_a_turn_waits_no_longer_than_a_flood_would(rig):
    rig.take_off()
    slept: list[int] = []

    def sleep_until(deadline_ns):
        slept.append(deadline_ns)
        rig.order(Verb.HOLD)
        return len(slept) < 2

    rig.process.sleep_until = sleep_until
    next_turn_ns = clock.now_ns() + S
    sleep_serving(rig.process, [rig.host], next_turn_ns)
    assert slept == [next_turn_ns, rig.host._turned_ns + 10_000_000]


@pytest.mark.parametrize(("scope", "told"), [((), 1), (("drone_1",), 1), ((OPERATOR, "drone_1"), 0)])
def test_an_order_without_the_right_to_it_is_told_unless_it_asks_the_operator(rig, scope, told):
    rig.connect()
    header = rig.other.header("team")
    stranger = Command(
        header=header, id="x", verb=Verb.TAKEOFF, scope=scope, issuer="cli", expires_ns=time.monotonic_ns() + S
    )
    rig.other.publish(COMMAND, stranger)
    rig.turn()
    assert sum("TAKEOFF of" in text for _, text, _ in rig.process.events) == told
    assert rig.decision.action == "IDLE"
