"""Flights over a bad wire and their checks: loss and disorder, a stranger's datagrams, damage in flight."""

import math
import time

from groundstation.bus.topics import VEHICLE_STATUS
from sim_bridge.conformance.bench import Bench
from sim_bridge.conformance.check import Case, NotApplicable, check
from sim_bridge.conformance.flights import LEG_S, SPEED_M_S, TURN_RAD_S, track_ahead
from sim_bridge.conformance.motions import lands
from sim_bridge.conformance.record import turned
from sim_bridge.conformance.script import script

LOSS, SWAP = 0.1, 0.1
_COPIES = 5
_UNSEEN = "the emulator sends no datagrams by sockets of Python"


@script()
def _lossy(bench: Bench) -> None:
    """From the start on one datagram in ten is lost and one in ten overtaken, in both directions."""
    bench.room.wire.loss, bench.room.wire.swap = LOSS, SWAP
    bench.track()
    with bench.mark("lossy"):
        bench.fly("lossy ahead", (SPEED_M_S, 0.0, 0.0), 0.0, LEG_S)
        time.sleep(1.2)
        bench.fly("lossy turn", (0.0, 0.0, 0.0), TURN_RAD_S, 2.0)
        time.sleep(0.8)
        bench.fly("lossy back", (-SPEED_M_S, 0.0, 0.0), 0.0, LEG_S)
        time.sleep(1.2)
    bench.land("lossy landing")


@script()
def _stranger(bench: Bench) -> None:
    """Another address repeats the vehicle's datagrams from the ground; then all its datagrams come from there."""
    track_ahead(bench)
    wire = bench.room.wire
    with bench.mark("a stranger beside it"):
        for _ in range(15):
            wire.repeat_as_stranger()
            time.sleep(0.1)
    bench.up.wanted = ((0.0, 0.0, 0.0), 0.0)
    time.sleep(1.0)
    wire.estranged = True
    bench.spend("a stranger alone", 1.5)
    bench.await_landing("landing beside a stranger")
    wire.estranged = False
    bench.record.facts["said"] = wire.said
    bench.record.facts["told to a stranger"] = wire.told_to_stranger()
    bench.spend("without a stranger", 2.5)
    bench.end()


@script()
def _damaged_aloft(bench: Bench) -> None:
    """Five damaged copies follow each datagram of a vehicle in flight; then the tracker falls silent; then LAND."""
    track_ahead(bench)
    bench.room.wire.copies = _COPIES
    bench.spend("damage aloft", 2.0)
    bench.up.speaks = False
    bench.spend("silence under damage", 2.0)
    bench.land("landing under damage")
    bench.record.facts["sent damaged"] = bench.room.wire.damaged
    bench.room.wire.copies = 0


@check("lossy")
def loss_ends_no_tracking(case: Case) -> None:
    """With one datagram in ten lost and one in ten overtaken it stays in TRACK and is never LOST."""
    heard = case.record.heard(VEHICLE_STATUS, "lossy")
    modes, states = {one.message.mode for one in heard}, {one.message.flight_state for one in heard}
    assert modes == {"TRACK"} and states <= {"FLYING", "HOVERING"}, f"modes {modes}, states {states}"


@check("lossy")
def loss_changes_no_way(case: Case) -> None:
    """Over such a wire it still flies ahead, back, and turns, by 0.6 to 1.35 of the command."""
    for mark, sign in (("lossy ahead", 1.0), ("lossy back", -1.0)):
        begin, end = case.record.span(mark)
        first, last = case.record.at(begin), case.record.at(end + 1_100_000_000)
        (x, y, _), (u, v, _), yaw = first.position, last.position, first.attitude[2]
        share = sign * (math.cos(yaw) * (u - x) + math.sin(yaw) * (v - y)) / (SPEED_M_S * LEG_S)
        assert 0.6 < share < 1.35, f"{mark}: {share:.2f} of the way"
    share = turned(case.record.motion("lossy turn")) / (2.0 * TURN_RAD_S)
    assert 0.6 < share < 1.35, f"{share:.2f} of the turn"


@check("lossy")
def loss_keeps_no_vehicle_up(case: Case) -> None:
    """Over such a wire LAND lands it."""
    lands(case, "lossy landing")


@check("stranger")
def stranger_is_not_believed(case: Case) -> None:
    """Another address that repeats the vehicle's datagrams from the ground changes nothing: it stays in TRACK."""
    heard = case.record.heard(VEHICLE_STATUS, "a stranger beside it")
    modes, states = {one.message.mode for one in heard}, {one.message.flight_state for one in heard}
    assert modes == {"TRACK"} and states <= {"FLYING", "HOVERING"}, f"modes {modes}, states {states}"
    speed = case.record.motion("a stranger beside it")[-1].speed
    assert speed > 0.2, f"{speed:.2f} m/s"


@check("stranger")
def stranger_is_not_taken_for_it(case: Case) -> None:
    """A vehicle whose datagrams come from another address only is LOST, and is landed."""
    if not case.record.facts.get("said", 1.0):
        raise NotApplicable(_UNSEEN)
    said = [one.message.flight_state for one in case.record.heard(VEHICLE_STATUS, "a stranger alone")]
    assert said and said[-1] == "LOST", f"said: {said[-3:]}"
    lands(case, "landing beside a stranger")


@check("stranger")
def stranger_is_told_nothing(case: Case) -> None:
    """No datagram is sent to the other address."""
    case.record.span("without a stranger")
    count = case.record.facts["told to a stranger"]
    assert not count, f"{count:.0f} datagrams"


@check("damaged_aloft")
def damage_aloft_ends_no_driver(case: Case) -> None:
    """The driver survives damaged datagrams in flight, without an error that it did not declare."""
    case.record.span("landing under damage")
    if not case.record.facts["sent damaged"]:
        raise NotApplicable(_UNSEEN)
    assert case.record.exits == [0], f"exit code {case.record.exits}: {case.record.log[-400:]}"
    place = case.record.log.find("Traceback")
    assert place < 0, case.record.log[place : place + 600]


@check("damaged_aloft")
def damage_aloft_is_counted(case: Case) -> None:
    """Damaged datagrams are counted as refused in its status."""
    case.record.span("landing under damage")
    if not case.record.facts["sent damaged"]:
        raise NotApplicable(_UNSEEN)
    told = case.record.heard(VEHICLE_STATUS)
    count = sum(told[-1].message.rejected.values()) if told else 0
    assert count > 0, "none is counted"


@check("damaged_aloft")
def damage_aloft_makes_nothing_faster(case: Case) -> None:
    """Meanwhile it is never faster than one and a half times its limit."""
    motion = case.record.motion("damage aloft") + case.record.motion("silence under damage")
    speed = max(one.speed for one in motion)
    assert speed < 1.5 * case.subject.limits.max_speed_m_s, f"{speed:.2f} m/s"


@check("damaged_aloft")
def damage_aloft_keeps_the_failsafe(case: Case) -> None:
    """Without setpoints it stands 1.35 s later, and LAND lands it, all under damage."""
    speed = max(one.speed for one in case.record.motion("silence under damage", 1.35))
    assert speed < 0.2, f"{speed:.2f} m/s"
    lands(case, "landing under damage")
