"""The liaison and the other host's link, without a network: commands, answers, silence, and clock offset."""

import time
from itertools import pairwise

import pytest

from groundstation.bus import clock
from groundstation.bus.memory_bus import MemoryBus, MemoryExchange
from groundstation.bus.messages import (
    ClockOffset,
    FlightState,
    Header,
    HostAnswer,
    HostReport,
    Lifecycle,
    Supervision,
    VehicleStatus,
)
from groundstation.bus.topics import CLOCK, HOST_ANSWER, HOST_ORDER, HOST_REPORT, VEHICLE_STATUS
from groundstation.process.clock_offset import OffsetFilter
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


def hear(both: Both, ahead_ns: int, own: OwnState = SERVES, turns: int = 1, name: str = "one") -> list[int]:
    """Let the run's host, whose clock is ahead, answer for some turns; return the offset in use after each of them."""
    used_ns = []
    for _ in range(turns):
        both.bus.publish(HOST_ANSWER, answer(both, name, ahead_ns))
        both.turn(own, None)
        used_ns.append(both.link.offset_ns)
    return used_ns


def test_the_offset_of_the_clocks_is_measured_and_published_and_begins_anew_with_another_clock(both: Both) -> None:
    for ahead_ns, name in ((895 * S, "one"), (-20 * S, "another")):
        hear(both, ahead_ns, OwnState(), 12, name)
        hear(both, ahead_ns, SERVES, 1, name)
        assert both.link.run_clock == name and both.link.synchronised
        assert both.link.offset_ns == pytest.approx(ahead_ns, abs=11 * MS)
        told = both.offsets.drain()[-1].message
        assert isinstance(told, ClockOffset) and told.of == clock.own_id() and told.offset_ns == both.link.offset_ns


def test_the_clock_that_devices_read_is_not_put_back_after_the_runs_host_slept(both: Both) -> None:
    """Their loops stood still for as long as it had slept, and what had expired lived again."""
    hear(both, 895 * S, OwnState(), 40)
    before_ns = hear(both, 895 * S, turns=40)[-1]
    after_ns = hear(both, 892 * S, turns=40)
    assert both.link.stood == "the clock of the run's host stood still for 3.0 s: it slept or was paused"
    assert min(after_ns) == before_ns
    told = both.offsets.drain()[-1].message
    assert isinstance(told, ClockOffset) and told.error_ns > 3 * S
    assert hear(both, 892 * S, OwnState())[-1] == pytest.approx(892 * S, abs=11 * MS), "nobody reads it any more"


def test_the_clock_that_devices_read_is_put_forward_after_this_host_slept_and_they_end_all_the_same(both: Both) -> None:
    hear(both, 895 * S, OwnState(), 40)
    hear(both, 895 * S, turns=2)
    assert hear(both, 900 * S, turns=5)[-1] == pytest.approx(900 * S, abs=11 * MS)
    assert both.link.stood == "the clock of this host stood still for 5.0 s: it slept or was paused"


def test_after_a_brief_pause_of_the_runs_host_the_clock_runs_at_half_speed_until_it_is_right(both: Both) -> None:
    hear(both, 895 * S, OwnState(), 40)
    before_ns = hear(both, 895 * S, turns=2)[-1]
    used_ns = hear(both, 895 * S - 150 * MS, turns=12)
    steps_ns = [before - after for before, after in pairwise([before_ns, *used_ns])]
    assert max(steps_ns) == 25 * MS, "of a turn's 50 ms"
    assert used_ns[-1] == pytest.approx(895 * S - 150 * MS, abs=21 * MS) and not both.link.stood


@pytest.mark.parametrize(("state", "slowly"), [(FlightState.LANDED, False), (FlightState.HOVERING, True)])
def test_small_corrections_are_slow_only_while_somebody_flies(both: Both, state: FlightState, slowly: bool) -> None:
    driver = MemoryBus(both.bus._exchange, "lab", "drone_1")
    hear(both, 895 * S, OwnState(), 40)
    before_ns = hear(both, 895 * S)[-1]
    driver.publish(VEHICLE_STATUS, VehicleStatus(header=driver.header("drone_1"), flight_state=state, mode="HOVER"))
    both.link._offsets = OffsetFilter()
    moved_ns = hear(both, 895 * S + 15 * MS, turns=20)[-1] - before_ns
    assert moved_ns == pytest.approx(MS if slowly else 15 * MS, rel=0.1), "in a second"


def test_a_restarted_host_of_the_run_is_not_heard_before_the_devices_of_the_former_run_have_ended(both: Both) -> None:
    hear(both, 895 * S, OwnState(), 12)
    before_ns = hear(both, 895 * S)[-1]
    assert set(hear(both, 20 * S, turns=20, name="another")) == {before_ns} and not both.link.watches(both.now_ns)
    hear(both, 20 * S, OwnState(), 12, "another")
    assert both.link.run_clock == "another" and both.link.watches(both.now_ns)


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
