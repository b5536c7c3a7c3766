"""Rounds of ranges that a stall has held up: which are used, and for what time they count."""

import select
import socket
from typing import Any

import pytest
from range_rig import HOST, MS, Rig

from drivers.ranging.gateway import Gateway
from drivers.ranging.wire.ranges import Round, encode
from groundstation.bus.messages import CameraStatus, RangeObservation


def observations(rig: Rig) -> list[RangeObservation]:
    told = [one.message for one in rig.heard.drain()]
    return [one for one in told if isinstance(one, RangeObservation)]


def test_of_rounds_that_come_at_once_after_a_stall_the_newest_is_used(
    rig: Rig, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Ten rounds of 0.9 s were all dated as new: 0.9 m apart, and 2 ms."""
    rig.driver.turn()
    rig.heard.drain()
    burst = [(10**12 + number * MS, Round("0x1", {"a": 1.0 + 0.1 * number, "b": 4.0})) for number in range(9)]
    newest = [(10**12 + 9 * MS, Round("0x1", {"a": 1.9}))]  # b did not answer
    parted = [(10**12 + MS, Round("drone_2", {"a": 2.0})), (10**12 + 2 * MS, Round("drone_2", {"b": 2.5}))]
    monkeypatch.setattr(rig.driver._gateway, "poll", lambda _wait_s: burst + newest + parted)
    rig.driver.turn()
    assert [dict(one.ranges_m) for one in observations(rig)] == [{"a": 1.9}, {"a": 2.0}, {"b": 2.5}]


def test_rounds_that_come_one_behind_the_other_count_as_come_at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """The reader is faster than the sender of a burst: of ten rounds in a row three were used, or all."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as own:
        own.bind((HOST, 0))
        own.settimeout(5.0)
        gateway = Gateway(HOST, own.getsockname()[1])
        gateway.poll(0.0)
        _, client = own.recvfrom(64)
        burst, wait = [encode(Round("0x1", {"a": 1.0 + 0.1 * number})) for number in range(10)], select.select

        def select_after_the_next(*call: Any) -> Any:
            if burst:
                own.sendto(burst.pop(0), client)
            return wait(*call)

        monkeypatch.setattr("drivers.ranging.gateway.select.select", select_after_the_next)
        assert len(gateway.poll(1.0)) == 10
        gateway.close()


def test_the_newest_round_after_a_stall_counts_for_the_time_it_was_measured_at(rig: Rig) -> None:
    began_ns = rig.clock.ns
    rig.driver.turn()
    rig.run(100, turn_every=1)
    for _ in range(190):  # 0.95 s; the last round of drone_1 was measured 50 ms before, and sent 30 ms before
        rig.clock.ns += 5 * MS
        rig.gateway.send()
    rig.driver.turn()
    (told,) = (one for one in observations(rig) if one.subject == "drone_1")
    assert abs(told.header.stamp_ns - began_ns - 280 * 5 * MS) < MS


def late(rig: Rig, number: int, late_ms: float) -> None:
    """Let a round arrive 10 times a second, late by the gateway's clock, which is an hour ahead."""
    arrival_ns = rig.clock.ns + round(late_ms * MS)
    sent_ms = rig.clock.ns / MS + 3.6e6
    rig.driver._handle(arrival_ns, Round("0x1", {"a": 1.0 + 0.01 * number}, sent_ms=sent_ms))
    rig.clock.ns += 100 * MS
    rig.driver.turn()


def test_a_round_that_comes_late_by_the_gateways_clock_counts_for_its_own_time(rig: Rig) -> None:
    for number in range(10):
        late(rig, number, 2.0)
    observations(rig)
    measured_ns = rig.clock.ns
    late(rig, 10, 202.0)
    (told,) = observations(rig)
    assert abs(told.header.stamp_ns - (measured_ns + 2 * MS - 20 * MS)) < MS


def test_rounds_that_come_too_late_are_silence_with_the_reason(rig: Rig) -> None:
    for number in range(10):
        late(rig, number, 2.0)
    rig.heard.drain()
    for number in range(10, 20):
        late(rig, number, 902.0)
    heard = [one.message for one in rig.heard.drain()]
    status = [one for one in heard if isinstance(one, CameraStatus)][-1]
    assert not any(isinstance(one, RangeObservation) for one in heard)
    assert not status.connected and status.detail == "no range for 0.3 s (its last rounds came late)"
    assert status.rejected == {"late": 10}
    late(rig, 20, 2.0)
    assert len(observations(rig)) == 1 and "ranging uwb: ranges arrive; " in rig.child.told[-1]
