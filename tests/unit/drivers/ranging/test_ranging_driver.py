"""The ranging driver with the emulated gateway on loopback, and with invalid datagrams."""

import math
import socket
import threading
import time
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from range_rig import ANCHORS, HOST, MS, PLACES, Rig

from drivers.ranging import driver as process
from drivers.ranging.gateway import Gateway
from drivers.ranging.settings import parse_source
from drivers.ranging.wire.ranges import Round, WireError, decode, encode
from groundstation.bus.messages import CameraStatus, RangeObservation
from groundstation.errors import SettingsError
from sim_bridge.fault_kinds import Fault, FaultKind


def test_rounds_come_with_their_place_and_the_time_they_were_measured_at(rig: Rig) -> None:
    rig.driver.turn()
    told = [one for one in rig.run(100) if isinstance(one, RangeObservation)]
    assert {one.subject for one in told} == {"drone_1", "drone_2"} and len(told) >= 6
    full = [one for one in told if one.subject == "drone_1" and one.position_m is not None]
    assert full and all(math.dist(one.position_m or (), (0.5, 0.2, 1.6)) < 0.02 for one in full)
    assert set().union(*(one.ranges_m for one in told)) == {"a", "b", "c", "d"}
    assert rig.driver.counts["unknown anchor"] > 0
    assert all(one.header.entity == "uwb" and rig.clock.ns - one.header.stamp_ns >= 15 * MS for one in told)
    assert rig.child.told[0] == "READY"


def test_silence_is_told_with_its_remedy_and_so_is_its_end(rig: Rig) -> None:
    rig.driver.turn()
    rig.run(100)
    rig.gateway.silent = True
    silent = [one for one in rig.run(200) if isinstance(one, CameraStatus)]
    assert not silent[-1].connected and silent[-1].detail == "no range for 0.3 s"
    assert "ranging uwb: no range for 0.3 s; check the gateway" in " ".join(rig.child.told)
    rig.gateway.silent = False
    well = [one for one in rig.run(200) if isinstance(one, CameraStatus)]
    assert well[-1].connected and well[-1].detections > 0 and rig.child.told[-2] == "READY"


def broken(kind: FaultKind, entity: str, **rest: Any) -> Fault:
    return Fault.model_validate({"kind": kind, "entity": entity, "start_s": 0.5, "end_s": 1.5, **rest})


@pytest.mark.parametrize("rig", [(broken(FaultKind.RANGES_FROZEN, "uwb", end_s=2.5),)], indirect=True)
def test_rounds_that_repeat_themselves_are_silence(rig: Rig) -> None:
    """A constant position of a flying drone would overrule its own velocity."""
    rig.driver.turn()
    before = [one for one in rig.run(100) if isinstance(one, RangeObservation)]
    rig.run(60)
    frozen = rig.run(300)
    assert before and not [one for one in frozen if isinstance(one, RangeObservation)]
    last = [one for one in frozen if isinstance(one, CameraStatus)][-1]
    assert not last.connected and "the ranges of drone_1, drone_2 repeat themselves" in last.detail
    assert last.rejected["repeated"] > 5
    assert [one for one in rig.run(100) if isinstance(one, RangeObservation)]
    assert rig.child.told[-4] == "READY", "then the ranges arrive, and those of two drones change again"


def test_one_drones_rounds_that_repeat_themselves_are_told_once_and_so_is_their_end(rig: Rig) -> None:
    """While another drone's ranges changed, the system counted as well, and only its detail said so."""
    rig.driver.turn()
    for number in range(12):
        repeated = 1.0 if number < 8 else 1.0 + 0.01 * number
        rig.driver._handle(10**12 + number * 100 * MS, Round("0x1", {"a": 1.0 + 0.01 * number}))
        rig.driver._handle(10**12 + number * 100 * MS, Round("drone_2", {"a": repeated}))
        rig.driver.turn()
    told = [text for text in rig.child.told if "drone_2" in text]
    assert told == [
        "ranging uwb: the ranges of drone_2 repeat themselves and are not used; restart the gateway",
        "ranging uwb: the ranges of drone_2 change again; ",
    ]


@pytest.mark.parametrize("rig", [(broken(FaultKind.ANCHOR_FROZEN, "uwb", other="b", end_s=4.0),)], indirect=True)
def test_an_anchor_that_holds_its_range_is_left_out_and_named(rig: Rig) -> None:
    rig.driver.turn()
    rig.run(100)
    rig.run(400)
    during = [one for one in rig.run(200) if isinstance(one, RangeObservation)]
    assert during and all(set(one.ranges_m) <= {"a", "c", "d"} for one in during)
    assert sum("anchor b holds its last range to drone_" in text for text in rig.child.told) == 1
    rig.run(300)
    after = [one for one in rig.run(100) if isinstance(one, RangeObservation)]
    assert set().union(*(one.ranges_m for one in after)) == {"a", "b", "c", "d"}
    assert any("anchor b measures again" in text for text in rig.child.told)


@pytest.mark.parametrize("rig", [(broken(FaultKind.RANGES_LONG, "drone_1", value=0.4),)], indirect=True)
def test_an_emulated_detour_makes_one_drones_ranges_longer(rig: Rig) -> None:
    rig.driver.turn()
    rig.run(110)
    told = [one for one in rig.run(80) if isinstance(one, RangeObservation) and "a" in one.ranges_m]
    for name, own, longer in (("drone_1", (0.5, 0.2, 1.6), 0.4), ("drone_2", PLACES["drone_2"], 0.0)):
        ranges = [one.ranges_m["a"] for one in told if one.subject == name]
        assert ranges and np.allclose(ranges, math.dist(own, ANCHORS["a"]) + longer, atol=0.01)


@pytest.mark.parametrize("rig", [(broken(FaultKind.RANGES_SILENT, "uwb"),)], indirect=True)
def test_an_emulated_gateway_falls_silent_and_comes_back(rig: Rig) -> None:
    rig.driver.turn()
    rig.run(110)
    assert not [one for one in rig.run(180) if isinstance(one, RangeObservation)]
    assert [one for one in rig.run(100) if isinstance(one, RangeObservation)]


def test_strangers_and_what_nobody_carries_are_counted(rig: Rig) -> None:
    rig.driver._handle(10**12 + 1, Round("0x9", {"a": 1.0}))
    rig.driver._handle(10**12 + 2, Round("0x1", {"a": 99.0}))
    rig.driver._handle(10**12 + 1, Round("0x1", {"a": 2.0}))
    assert not [one for one in rig.run(1) if isinstance(one, RangeObservation) and one.subject == "drone_1"]
    assert rig.driver.counts["unknown transponder"] == rig.driver.counts["beyond reach"] == 1


@pytest.mark.parametrize(
    ("datagram", "reason"),
    [
        (b"", "damaged"),
        (b"\xff{", "damaged"),
        (b'{"transponder": "t"}', "damaged"),
        (b'{"transponder": "t", "m": {}}', "damaged"),
        (b'{"transponder": "t", "m": {"a": "1"}}', "damaged"),
        (b'{"transponder": "t", "m": {"a": -1}}', "impossible"),
        (b'{"transponder": "t", "m": {"a": 1e9}}', "impossible"),
        (b'{"transponder": "t", "m": {"a": 1}, "age_ms": 1e9}', "impossible"),
        (b'{"transponder": "t", "m": {"a": 1}, "sent_ms": -1}', "impossible"),
        (b'{"transponder": "t", "m": {"a": 1}, "sent_ms": 1e16}', "impossible"),
        (b'{"transponder": "t", "m": {"a": 1}, "sent_ms": "1"}', "damaged"),
        (b'{"transponder": "t", "m": {"a": 1}}' + b" " * 1400, "too long"),
        (b'{"transponder": "' + b"t" * 200 + b'", "m": {"a": 1}}', "damaged"),
    ],
)
def test_invalid_ranging_rounds_are_refused_with_a_reason(datagram: bytes, reason: str) -> None:
    with pytest.raises(WireError) as refused:
        decode(datagram)
    assert refused.value.reason == reason


def test_a_round_survives_the_wire_and_unknown_keys_are_passed_over() -> None:
    told = Round("0x1", {"a": 1.25, "b": 3.5}, 4.0, 1.8e12)
    assert decode(encode(told)) == told
    assert decode(b'{"transponder": "0x1", "m": {"a": 1}, "quality": [1]}') == Round("0x1", {"a": 1.0})


def test_a_wrong_section_is_told_by_its_key() -> None:
    child: Any = SimpleNamespace(section='{"name": "uwb"}')
    with pytest.raises(SettingsError, match="ranging: source"):
        process.run(child)


def test_the_process_ends_when_it_is_asked_to(rig: Rig) -> None:
    rig.child.stop_requested = True
    child: Any = rig.child
    assert process.run(child) == 0


@pytest.mark.parametrize(
    "text", ["udp://1.2.3.4", "ranges://", "ranges://h/p", "ranges://h:99999", "ranges://a b", "ranges://u@h"]
)
def test_a_wrong_address_is_refused_with_the_form(text: str) -> None:
    with pytest.raises(ValueError, match=r"as in ranges://192\.168\.1\.6:7417"):
        parse_source(text)
    assert parse_source("ranges://10.0.0.7") == ("10.0.0.7", 7417)


def test_ranges_of_another_host_are_strangers_whatever_port_they_come_from() -> None:
    told = encode(Round("0x1", {"a": 1.25}))
    with (
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as own,
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as stranger,
    ):
        own.bind((HOST, 0))
        own.settimeout(5.0)
        stranger.bind(("127.0.0.9", own.getsockname()[1]))
        gateway = Gateway("localhost", own.getsockname()[1])
        asked = threading.Event()
        poller = threading.Thread(target=lambda: [gateway.poll(0.05) for _ in iter(asked.is_set, True)])
        poller.start()
        _, client = own.recvfrom(64)
        asked.set()
        poller.join()
        stranger.sendto(told, ("127.0.0.1", client[1]))
        own.sendto(told, ("127.0.0.1", client[1]))
        assert [one.m for _, one in gateway.poll(1.0) + gateway.poll(0.1)] == [{"a": 1.25}]
        assert gateway.rejected == {"stranger": 1}
        gateway.close()


def test_a_name_that_is_looked_up_slowly_delays_nothing_and_is_told_if_it_is_none(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    released = threading.Event()

    def looked_up(*_: object) -> list[Any]:
        released.wait(10.0)
        raise OSError(1, "Name or service not known")

    monkeypatch.setattr("drivers.host_lookup.socket.getaddrinfo", looked_up)
    gateway = Gateway("uwb-gateway", 7417)
    began = time.monotonic()
    assert gateway.poll(0.0) == [] and not gateway.failed and time.monotonic() - began < 1.0
    released.set()
    while not gateway.failed and time.monotonic() - began < 5.0:
        time.sleep(0.01)
    assert "no IPv4 address is known for the name uwb-gateway" in gateway.failed
    gateway.close()
