"""Another host's side of the exchange with the run's host: order, silence of the supervisor, offset of the clock."""

import os
from dataclasses import dataclass

from groundstation.bus import clock
from groundstation.bus.api import Bus, Received
from groundstation.bus.messages import (
    AIRBORNE,
    STANDING,
    ClockOffset,
    HostAnswer,
    HostOrder,
    HostReport,
    Lifecycle,
    Supervision,
    VehicleStatus,
    flies,
)
from groundstation.bus.topics import CLOCK, HOST_ANSWER, HOST_ORDER, HOST_REPORT, VEHICLE_STATUS
from groundstation.process.clock_offset import OffsetFilter, RoundTrip, led
from groundstation.time_units import NS_PER_MS, NS_PER_S

_PERIOD_NS = 40 * NS_PER_MS
_CLOCK_PERIOD_NS = NS_PER_S
# A lost packet of the link is resent within this; after that the drivers' own limits of silence begin.
_HEARD_NS = 200 * NS_PER_MS
# Of a clock that stood still; no computer sleeps more briefly.
_STOOD_NS = 300 * NS_PER_MS


@dataclass(frozen=True, slots=True)
class OwnState:
    """Report of this host; run: the run that it serves, "" for none."""

    run: str = ""
    state: Lifecycle = Lifecycle.STARTING
    detail: str = ""


class HostLink:
    """Call `turn` 20 times a second or more. order: the newest one; ends: whether the run is over for its devices.

    offset_ns: offset of the run's clock, by which processes here read it. stood: which of the clocks stood still while
    devices were served, so that nobody watched over the drones, or "".
    """

    def __init__(self, bus: Bus, host: str) -> None:
        self._bus, self._host = bus, host
        self.instance = os.urandom(8).hex()
        self._orders = bus.subscribe([HOST_ORDER], entity=host, newest=True)
        self._answers = bus.subscribe([HOST_ANSWER], entity=host, capacity=256)
        self._statuses = bus.subscribe([VEHICLE_STATUS], newest=True)
        self._aloft = set[str]()
        self._offsets = OffsetFilter()
        self._next_ns = self._next_clock_ns = self._led_ns = 0
        self._supervision = Supervision.SILENT
        self.order: HostOrder | None = None
        self.run_clock = ""
        self.heard_ns = 0
        self.offset_ns = self._error_ns = 0
        self.stood = ""

    @property
    def synchronised(self) -> bool:
        """Return whether the run's clock can be read here."""
        return self._offsets.known

    @property
    def ends(self) -> bool:
        """Return whether the run's supervisor stops the run, or is dead."""
        return self._supervision is Supervision.ENDS

    def watches(self, now_ns: int) -> bool:
        """Return whether the run's supervisor has just sent and is not frozen."""
        return self._supervision is not Supervision.SILENT and now_ns - self.heard_ns < _HEARD_NS

    def silent_s(self, now_ns: int) -> float:
        """Return how long the run's host has been silent [s]."""
        return (now_ns - self.heard_ns) / NS_PER_S

    def turn(self, now_ns: int, own: OwnState) -> None:
        """Take in messages, and report; now_ns: this host's own boot clock."""
        for received in self._orders.drain():
            if isinstance(received.message, HostOrder):
                self.order = received.message
        for received in self._answers.drain():
            self._hear(received, serves=bool(own.run))
        for received in self._statuses.drain():
            if isinstance(received.message, VehicleStatus):
                self._see(received.message)
        if self.synchronised:
            self._lead(now_ns, serves=bool(own.run))
        if now_ns >= self._next_ns:
            self._next_ns = now_ns + _PERIOD_NS
            self._report(own)
        if self.synchronised and own.run and now_ns >= self._next_clock_ns:
            self._next_clock_ns = now_ns + _CLOCK_PERIOD_NS
            self._publish_offset()

    def _see(self, status: VehicleStatus) -> None:
        if status.flight_state in AIRBORNE or flies(status.flight_state, status.mode):
            self._aloft.add(status.header.entity)
        elif status.flight_state in STANDING:
            self._aloft.discard(status.header.entity)

    def _hear(self, received: Received, serves: bool) -> None:
        answer = received.message
        if not isinstance(answer, HostAnswer) or answer.instance != self.instance:
            return
        if answer.header.clock != self.run_clock:  # the run's host was restarted
            if serves and self.run_clock:  # to processes of the former run it stays silent
                return
            self.run_clock, self._offsets = answer.header.clock, OffsetFilter()
            self._led_ns = self._next_clock_ns = 0
        self._supervision, self.heard_ns = answer.supervision, received.arrived_ns
        self._offsets.take(RoundTrip(answer.sent_ns, answer.received_ns, answer.header.stamp_ns, received.arrived_ns))

    def _lead(self, now_ns: int, serves: bool) -> None:
        wanted_ns, last_ns, self._led_ns = self._offsets.offset_ns(now_ns), self._led_ns, now_ns
        if not serves or not last_ns:  # nobody reads the clock
            self.offset_ns = wanted_ns
        else:
            self.stood = self.stood or self._stood(wanted_ns - self.offset_ns)
            if self.stood:  # back would revive what has expired, and drones still land by this clock
                self.offset_ns = max(self.offset_ns, wanted_ns)
            else:
                elapsed_s = (now_ns - last_ns) / NS_PER_S
                self.offset_ns = led(self.offset_ns, wanted_ns, elapsed_s, rests=not self._aloft)
        self._error_ns = self._offsets.error_ns(self.offset_ns, now_ns)

    def _stood(self, apart_ns: int) -> str:
        if abs(apart_ns) <= self._error_ns + _STOOD_NS:
            return ""
        whose = "this host" if apart_ns > 0 else "the run's host"
        return f"the clock of {whose} stood still for {abs(apart_ns) / NS_PER_S:.1f} s: it slept or was paused"

    def _report(self, own: OwnState) -> None:
        header = self._bus.header(self._host)
        report = HostReport(
            header=header,
            run=own.run,
            state=own.state,
            detail=own.detail,
            sent_ns=clock.own_ns(),
            instance=self.instance,
        )
        self._bus.publish(HOST_REPORT, report)

    def _publish_offset(self) -> None:
        if clock.own_id() != self.run_clock:
            header = self._bus.header(self._host)
            offset_ns, error_ns = self.offset_ns, self._error_ns
            self._bus.publish(
                CLOCK, ClockOffset(header=header, of=clock.own_id(), offset_ns=offset_ns, error_ns=error_ns)
            )
