"""The reader thread: packets of which nothing is published are read two at once, and no message changes by that."""

import threading
from collections.abc import Callable, Iterator
from itertools import pairwise
from typing import Any

import pytest

from drivers.ardrone.driver import ArDrone
from drivers.ardrone.link import Arrival
from drivers.ardrone.publisher import NavdataPublisher
from drivers.ardrone.settings import ArDroneDriverSettings
from drivers.ardrone.wire import navdata, options
from drivers.ardrone.wire.navdata import Navdata
from groundstation.bus.messages import Odometry
from groundstation.time_units import NS_PER_MS

_SOURCE = ("127.0.0.1", 5554)
_HEALTHY, _FLY = 0x0F800000, 1


class _IdleThread:
    def __init__(self, **_: Any) -> None: ...
    def start(self) -> None: ...
    def join(self, timeout: float | None = None) -> None: ...


@pytest.fixture
def drone(monkeypatch: pytest.MonkeyPatch, new_bus: Callable[[], Any]) -> Iterator[ArDrone]:
    monkeypatch.setattr(threading, "Thread", _IdleThread)
    settings = ArDroneDriverSettings(name="drone_1", address="127.0.0.1", raw_datagrams=False)
    made = ArDrone(settings, new_bus())
    yield made
    made.close()


def arrival(number: int, state: int = _HEALTHY | _FLY) -> Arrival:
    demo = options.DEMO.encode(options.Demo(altitude_mm=900, vx_mm_s=number, vy_mm_s=2 * number), 148)
    phys = options.PHYS_MEASURES.encode(options.PhysMeasures(rates_deg_s=(number / 10, 0.0, 0.0)))
    datagram = navdata.encode(Navdata(state, number, 0, ((0, demo), (3, phys))))
    return Arrival((1000 + 5 * number) * NS_PER_MS, datagram, _SOURCE)


def read(drone: ArDrone, *arrivals: Arrival | None) -> None:
    waiting = iter(arrivals)
    drone._link.receive = lambda: next(waiting)  # type: ignore[method-assign]
    with pytest.raises(StopIteration):
        drone._read()


def test_a_packet_of_which_nothing_is_due_waits_for_the_next(drone: ArDrone) -> None:
    arrivals = [arrival(number) for number in range(1, 8)]
    heard = []
    for one in arrivals:
        read(drone, one)
        heard.append(drone.telemetry.heard_ns)
    stamps = [one.stamp_ns for one in arrivals]
    assert heard == [*stamps[:2], stamps[1], stamps[3], stamps[3], *stamps[5:]]
    assert drone._link.rates(stamps[6]) == (7.0, 1.0)


def test_a_waiting_packet_is_read_when_no_other_comes(drone: ArDrone) -> None:
    read(drone, *(arrival(number) for number in range(1, 4)))
    assert drone.telemetry.heard_ns == arrival(2).stamp_ns
    read(drone, None)
    assert drone.telemetry.heard_ns == arrival(3).stamp_ns


def test_a_status_packet_never_waits_long_and_a_damaged_one_is_counted(drone: ArDrone) -> None:
    status = Arrival(1000 * NS_PER_MS, navdata.encode(Navdata(_HEALTHY, 1)), _SOURCE)
    read(drone, status)
    assert drone.telemetry.heard_ns == status.stamp_ns
    read(drone, arrival(2)._replace(datagram=b"short"), arrival(3)._replace(source=("127.0.0.9", 1)))
    assert drone._link.rejected == {"too_short": 1, "foreign_address": 1}


def test_messages_are_those_of_packets_read_one_by_one(drone: ArDrone, new_bus: Callable[[], Any]) -> None:
    arrivals = [arrival(number) for number in range(1, 400) if number % 17]
    together: Any = drone._publisher._bus
    read(drone, *arrivals)
    alone = new_bus()
    drone._publisher = NavdataPublisher(drone._settings, alone)
    drone._plausibility.reset()
    for one in arrivals:
        drone._hear(one.stamp_ns, navdata.decode(one.datagram))
    assert len(alone.sent) > 140 and alone.sent == together.sent


@pytest.mark.parametrize(("state", "motion", "fresh"), [(_FLY, True, False), (_FLY, False, True), (0, True, True)])
def test_in_flight_status_alone_is_no_telemetry_once_motion_was_reported(
    drone: ArDrone, state: int, motion: bool, fresh: bool
) -> None:
    """As after its restart, or if another program configures it: velocity and battery would be those of before.

    A driver that was restarted in flight hears status first, and must be able to land it.
    """
    if motion:
        read(drone, arrival(1, _HEALTHY | state), arrival(2, _HEALTHY | state))
    for number in range(3, 20):
        status = navdata.encode(Navdata(_HEALTHY | state, number))
        read(drone, Arrival((1000 + 60 * number) * NS_PER_MS, status, _SOURCE), None)
    view = drone.view((1000 + 60 * 20) * NS_PER_MS)
    assert view.fresh is fresh
    assert ("no motion" in view.silence) is not fresh


def flying(number: int, vx_mm_s: int, vy_mm_s: int) -> Arrival:
    speeds = options.Demo(control_state=3 << 16, altitude_mm=900, vx_mm_s=vx_mm_s, vy_mm_s=vy_mm_s)
    datagram = navdata.encode(Navdata(_HEALTHY | _FLY, number, 0, ((0, options.DEMO.encode(speeds, 148)),)))
    return Arrival((1000 + 5 * number) * NS_PER_MS, datagram, _SOURCE)


def test_a_velocity_that_drops_to_noise_about_zero_at_once_counts_as_a_lost_floor(drone: ArDrone) -> None:
    read(drone, *(flying(number, 400 + number % 7, number % 5) for number in range(1, 51)))
    assert not drone.view(1250 * NS_PER_MS).unsound
    read(drone, *(flying(number, number % 7 - 3, number % 5 - 2) for number in range(51, 101)))
    assert "does not see the floor" in drone.view(1500 * NS_PER_MS).unsound


def timed(number: int, at_s: float, clock_s: float, state: int) -> Arrival:
    phase, stir = (3 if state & _FLY else 2) << 16, float(number % 7)
    demo = options.Demo(phase, theta_mdeg=stir, phi_mdeg=stir, altitude_mm=900, vx_mm_s=stir, vy_mm_s=stir)
    time = options.TIME.encode(options.Time.from_seconds(clock_s))
    datagram = navdata.encode(Navdata(state, number, 0, ((0, options.DEMO.encode(demo, 148)), (1, time))))
    return Arrival(round(at_s * 1e9), datagram, _SOURCE)


@pytest.mark.parametrize(("pause_s", "clock_s"), [(900.0, 20.0), (2100.0, 1552.0)])
def test_a_drone_that_was_restarted_in_a_pause_is_not_late(drone: ArDrone, pause_s: float, clock_s: float) -> None:
    """Its clock wraps after 2048 s; neither a step back nor a round of it during the pause says anything."""
    read(drone, *(timed(i, 10 + i * 0.005, 1500 + i * 0.005, _HEALTHY) for i in range(1, 200)))
    for i in range(1, 400):
        state = _HEALTHY | (_FLY if i > 100 else 0)
        read(drone, timed(i, 11 + pause_s + i * 0.005, clock_s + i * 0.005, state), None)
    assert drone.view(round((13 + pause_s) * 1e9)).unsound == ""


def test_messages_are_dated_by_the_drones_clock_over_a_stall_of_the_link(drone: ArDrone) -> None:
    """What came in a burst was measured over all of the stall; how old it is counts by its arrival."""
    held, came_s = range(200, 230), 10 + 230 * 0.005
    arrivals = [timed(i, came_s if i in held else 10 + i * 0.005, 1500 + i * 0.005, _HEALTHY) for i in range(1, 260)]
    read(drone, *arrivals, None)
    bus: Any = drone._publisher._bus
    stamps = [message.header.stamp_ns for message in bus.sent if isinstance(message, Odometry)]
    assert max(after - before for before, after in pairwise(stamps)) <= 25 * NS_PER_MS
    assert drone.telemetry.heard_ns == arrivals[-1].stamp_ns
