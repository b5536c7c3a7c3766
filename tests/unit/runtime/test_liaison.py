"""The liaison and the other host's link, without a network: commands, answers, silence, and clock offset."""

import time

import pytest

from groundstation.bus import clock
from groundstation.bus.memory_bus import MemoryBus, MemoryExchange
from groundstation.bus.messages import ClockOffset, Header, HostAnswer, HostReport, Lifecycle, Supervision
from groundstation.bus.topics import CLOCK, HOST_ANSWER, HOST_ORDER, HOST_REPORT
from groundstation.runtime.liaison import Liaison, LiaisonSection
from groundstation.supervisor.host_link import HostLink, OwnState

MS, S = 1_000_000, 1_000_000_000
HOST = "lab_pc_2"
SERVES = OwnState("run-7", Lifecycle.READY)


class Both:
    """Both ends on one exchange, 50 ms per turn."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.now_ns = 100 * S
        monkeypatch.setattr(time, "monotonic_ns", lambda: self.now_ns)
        exchange = MemoryExchange()
        self.bus = MemoryBus(exchange, "lab", f"liaison_{HOST}", "run-7")
        self.liaison = Liaison(self.bus, LiaisonSection(HOST, "1.0", "{}"))
        self.link = HostLink(MemoryBus(exchange, "lab", HOST), HOST)
        self.orders = self.bus.subscribe([HOST_ORDER])
        self.offsets = self.bus.subscribe([CLOCK])

    def turn(self, own: OwnState | None, supervision: Supervision | None = Supervision.WATCHES, turns: int = 1) -> None:
        """Run one turn of both ends; None: that end is frozen."""
        for _ in range(turns):
            self.now_ns += 50 * MS
            if own is not None:
                self.link.turn(self.now_ns, own)
            if supervision is not None:
                self.liaison.turn(self.now_ns, supervision)


@pytest.fixture
def both(monkeypatch: pytest.MonkeyPatch) -> Both:
    return Both(monkeypatch)


def test_a_host_is_told_what_to_run_until_it_serves_the_run(both: Both) -> None:
    assert both.liaison.state(both.now_ns)[0] is Lifecycle.STARTING
    both.turn(OwnState(), turns=45)
    assert both.link.order is not None and (both.link.order.run, both.link.order.version) == ("run-7", "1.0")
    assert len(both.orders.drain()) == 3, "one in a second"
    both.turn(SERVES, turns=60)
    assert len(both.orders.drain()) <= 1 and both.liaison.state(both.now_ns)[0] is Lifecycle.READY
    both.turn(OwnState("run-7", Lifecycle.DEGRADED, "not well: ceiling"))
    assert both.liaison.state(both.now_ns) == (Lifecycle.DEGRADED, "not well: ceiling")


def test_silence_of_either_end_is_noticed_by_the_other(both: Both) -> None:
    both.turn(SERVES, turns=5)
    assert both.link.watches(both.now_ns) and not both.liaison.silent(both.now_ns)
    both.turn(SERVES, None, turns=5)
    assert not both.link.watches(both.now_ns), "0.25 s without an answer"
    both.turn(SERVES, turns=2)
    assert both.link.watches(both.now_ns)
    both.turn(None, turns=11)
    assert both.liaison.silent(both.now_ns)
    assert both.liaison.state(both.now_ns) == (Lifecycle.DEGRADED, f"{HOST} is silent")


def test_a_host_that_said_that_it_ends_is_not_missed_at_once(both: Both) -> None:
    both.turn(OwnState("run-7", Lifecycle.STOPPING), turns=5)
    both.turn(None, turns=58)
    assert not both.liaison.silent(both.now_ns), "2.9 s"
    both.turn(None, turns=4)
    assert both.liaison.silent(both.now_ns) and both.liaison.serving, "nobody knows whether its drones have landed"


def test_a_frozen_supervisor_is_silent_and_a_dead_one_ends_the_run(both: Both) -> None:
    both.turn(SERVES, turns=3)
    both.turn(SERVES, Supervision.SILENT, turns=2)
    assert not both.link.watches(both.now_ns) and not both.link.ends
    both.turn(SERVES, Supervision.ENDS, turns=2)
    assert both.link.ends
    both.turn(OwnState(), Supervision.ENDS, turns=2)
    assert not both.liaison.serving and both.orders.drain()[1:] == [], "who has ended is told nothing new"


def answer(both: Both, name: str, ahead_ns: int) -> HostAnswer:
    header = Header(both.now_ns + ahead_ns, name, HOST, f"liaison_{HOST}", 1)
    stamps = {"sent_ns": both.now_ns - 40 * MS, "received_ns": both.now_ns + ahead_ns - 20 * MS}
    return HostAnswer(header=header, supervision=Supervision.WATCHES, instance=both.link.instance, **stamps)


def test_the_offset_of_the_clocks_is_measured_and_published_and_begins_anew_with_another_clock(both: Both) -> None:
    for ahead_ns, name in ((895 * S, "one"), (-20 * S, "another")):
        for _ in range(12):
            both.bus.publish(HOST_ANSWER, answer(both, name, ahead_ns))
            both.turn(SERVES, None)
        assert both.link.run_clock == name and both.link.synchronised
        assert both.link.offset_ns == pytest.approx(ahead_ns, abs=11 * MS)
        told = both.offsets.drain()[-1].message
        assert isinstance(told, ClockOffset) and told.of == clock.own_id() and told.offset_ns == both.link.offset_ns


def test_a_report_of_another_name_is_not_heard(both: Both) -> None:
    liar = MemoryBus(both.bus._exchange, "lab", "drone_1")
    liar.publish(HOST_REPORT, HostReport(header=liar.header(HOST), run="run-7", sent_ns=0))
    both.turn(None)
    assert not both.liaison.serving


def test_of_two_processes_under_one_name_only_the_first_may_serve_until_it_is_silent(both: Both) -> None:
    both.turn(SERVES, turns=3)
    second = HostLink(MemoryBus(both.bus._exchange, "lab", HOST), HOST)
    for _ in range(40):
        second.turn(both.now_ns, OwnState("", Lifecycle.DEGRADED, "of the second"))
        both.turn(SERVES)
    assert both.liaison.doubled and both.liaison.serving and both.link.watches(both.now_ns)
    assert not second.synchronised and not second.watches(both.now_ns), "or it would start the same drivers"
    for _ in range(40):
        second.turn(both.now_ns, OwnState())
        both.turn(None)
    assert second.synchronised and second.watches(both.now_ns) and not both.liaison.doubled
