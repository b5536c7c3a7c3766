"""Orders that wait for a driver: those to others displace none, and those that are lost are reported."""

from typing import Any, cast

from drivers.base import HostProcess, LinkHealth, Vehicle
from drivers.host import VehicleHost
from drivers.watchdog_types import DriverMode, VehicleView, WatchdogLimits
from groundstation.bus import clock
from groundstation.bus import messages as m
from groundstation.bus import topics as t
from groundstation.bus.api import Sample
from groundstation.bus.memory_bus import MemoryBus, MemoryExchange

MS = 1_000_000
TOO_MANY = 300


class Process:
    """A process of a driver, whose events are kept."""

    name, section, spoken_for_ns = "drone_1", "{}", 0
    stop_requested, supervisor_alive, supervisor_fresh = False, True, True

    def __init__(self, bus: MemoryBus) -> None:
        self.bus, self.told = bus, list[str]()

    def ready(self, detail: str = "") -> None:
        pass

    def event(self, _severity: object, text: str, *_: object) -> None:
        self.told.append(text)


class Hovering:
    name, address = "drone_1", "10.0.0.1"

    def view(self, _now_ns: int) -> VehicleView:
        return VehicleView(m.FlightState.HOVERING, True, 0.9)

    def health(self, _now_ns: int) -> LinkHealth:
        return LinkHealth()

    def apply(self, _now_ns: int, _decision: object) -> None:
        pass

    def flush(self) -> None:
        pass


class Seat:
    """The host of a drone that hovers, and a member of its run that orders."""

    def __init__(self) -> None:
        exchange = MemoryExchange()
        self.process = Process(MemoryBus(exchange, "lab", "drone_1"))
        self.member = MemoryBus(exchange, "lab", "cli_1")
        self.statuses = self.member.subscribe([t.VEHICLE_STATUS])
        self.host = VehicleHost(cast(HostProcess, self.process), cast(Vehicle, Hovering()), WatchdogLimits())
        self.host.watchdog.mode = DriverMode.HOLD
        self.now_ns = clock.now_ns()
        self._count = 0
        self.turn()

    def turn(self) -> DriverMode:
        self.now_ns += 250 * MS
        return self.host.turn(self.now_ns).mode

    def order(self, verb: m.Verb, *scope: str, times: int = 1) -> None:
        for _ in range(times):
            self._count += 1
            header = self.member.header("team")
            order = m.Command(header=header, id=f"{self._count}", verb=verb, scope=scope, issuer="cli_1")
            self.member.publish(t.COMMAND, order)

    def rejected(self) -> Any:
        return self.statuses.drain()[-1].message.rejected  # type: ignore[union-attr]


def test_orders_to_others_displace_no_stop() -> None:
    seat = Seat()
    seat.order(m.Verb.LAND)
    seat.order(m.Verb.HOLD, "drone_9", times=TOO_MANY)
    seat.order(m.Verb.RESUME, m.OPERATOR, "drone_1", times=TOO_MANY)
    assert seat.turn() is DriverMode.LANDING
    assert seat.host.overflowed == 0 and seat.rejected() == {}


def test_orders_that_were_lost_are_counted_and_told() -> None:
    seat = Seat()
    seat.order(m.Verb.HOLD, times=TOO_MANY)
    seat.turn()
    lost = TOO_MANY - 256
    assert seat.host.overflowed == lost and seat.rejected() == {"overflow": lost}
    assert any(f"refused {lost} orders and leases unread" in text for text in seat.process.told)


def test_a_malformed_order_is_still_counted() -> None:
    seat = Seat()
    key = seat.member.key(t.COMMAND, "team")
    seat.host._commands.offer(Sample(key, b"{"))
    seat.turn()
    seat.turn()
    assert seat.rejected() == {"command_malformed": 1}
