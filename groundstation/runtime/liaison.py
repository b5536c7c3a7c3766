"""The liaison process: communicates for the supervisor with one other host that runs devices of the field.

It sends the host its order, answers its time requests, and falls silent to it when the supervisor does. To the
supervisor it represents all devices there: it is unwell while the host is, and ends when they have ended.
"""

from importlib.metadata import version

import msgspec

from groundstation.bus import clock
from groundstation.bus.api import Bus, Received
from groundstation.bus.messages import (
    HostAnswer,
    HostOrder,
    HostReport,
    Lifecycle,
    Severity,
    Supervision,
)
from groundstation.bus.topics import HOST_ANSWER, HOST_ORDER, HOST_REPORT
from groundstation.process.child import Child
from groundstation.time_units import NS_PER_MS, NS_PER_S

VERSION = version("skein-groundstation")
_TURN_NS = 50 * NS_PER_MS
_ORDER_PERIOD_NS = NS_PER_S
_SILENT_NS = 500 * NS_PER_MS
# For a host that announced that it ends its processes: that keeps a small computer busy.
_ENDING_SILENT_NS = 3 * NS_PER_S
# As long as drivers may take to land and end, including the guardian that waits for them.
_LINGER_NS = 25 * NS_PER_S
# A host whose devices are still starting is waited for; a host that nobody has started is not.
_START_NS = 15 * NS_PER_S


class LiaisonSection(msgspec.Struct, frozen=True):
    """A liaison's section: the other host, the version of the program, the field as JSON."""

    host: str
    version: str
    field: str


class Liaison:
    """The exchange with one host; times are of the run's clock.

    If two processes use its name, only the first counts until it is silent. doubled: whether a second has just sent.
    """

    def __init__(self, bus: Bus, section: LiaisonSection) -> None:
        self._bus, self._section = bus, section
        self.reports = bus.subscribe([HOST_REPORT], entity=section.host, source=section.host, capacity=256)
        self._newest: HostReport | None = None
        self._heard_ns = 0
        self.doubled = False
        self._next_order_ns = 0

    def turn(self, now_ns: int, supervision: Supervision) -> None:
        """Answer messages; give the order to a host that does not serve this run yet."""
        reports = [(one, one.message) for one in self.reports.drain() if isinstance(one.message, HostReport)]
        if reports:
            self.doubled = False
        for received, report in reports:
            if self._is_second(received, report):
                self.doubled = True
                continue
            self._newest, self._heard_ns = report, received.arrived_ns
            self._answer(received, report, supervision)
        if supervision is Supervision.WATCHES and not self.serving and now_ns >= self._next_order_ns:
            self._next_order_ns = now_ns + _ORDER_PERIOD_NS
            section = self._section
            header = self._bus.header(section.host)
            order = HostOrder(header=header, run=self._bus.run, version=section.version, field=section.field)
            self._bus.publish(HOST_ORDER, order)

    def _is_second(self, received: Received, report: HostReport) -> bool:
        first = self._newest
        return first is not None and report.instance != first.instance and not self.silent(received.arrived_ns)

    def _answer(self, received: Received, report: HostReport, supervision: Supervision) -> None:
        header = self._bus.header(self._section.host)
        answer = HostAnswer(
            header=header,
            supervision=supervision,
            sent_ns=report.sent_ns,
            received_ns=received.arrived_ns,
            instance=report.instance,
        )
        self._bus.publish(HOST_ANSWER, answer)

    @property
    def serving(self) -> bool:
        """Return whether the host's last report says that it serves this run."""
        return self._newest is not None and self._newest.run == self._bus.run

    def silent(self, now_ns: int) -> bool:
        """Return whether the host has been silent for a while."""
        ending = self._newest is not None and self._newest.state is Lifecycle.STOPPING
        return now_ns - self._heard_ns > (_ENDING_SILENT_NS if ending else _SILENT_NS)

    def state(self, now_ns: int) -> tuple[Lifecycle, str]:
        """Return the lifecycle state of the host's devices, and a description."""
        host, newest = self._section.host, self._newest
        if newest is None:
            return Lifecycle.STARTING, f"{host} is not there: on it, groundstation host"
        if self.silent(now_ns):
            return Lifecycle.DEGRADED, f"{host} is silent"
        if not self.serving:
            return Lifecycle.STARTING, newest.detail or f"{host} is told what to run"
        return newest.state, newest.detail or f"devices of {host}"


def run(child: Child) -> int:
    """Exchange messages with the host until the run and the devices there have ended; the process entry."""
    liaison = Liaison(child.bus, msgspec.json.decode(child.section, type=LiaisonSection))
    liaison.reports.on_arrival = child.wake
    began_ns, ends_ns, was_silent, was_doubled = clock.now_ns(), 0, False, False
    while True:
        now_ns = clock.now_ns()
        supervision = _supervision(child)
        liaison.turn(now_ns, supervision)
        _tell(child, liaison, now_ns, now_ns - began_ns < _START_NS)
        silent = liaison.silent(now_ns) and liaison.serving
        if silent and not was_silent:
            child.event(Severity.ERROR, "is silent: it, or the link to it, is down", "look at that host")
        was_silent = silent
        if liaison.doubled and not was_doubled:
            child.event(
                Severity.WARNING, "is there twice: the second one gets no devices", "end one `groundstation host`"
            )
        was_doubled |= liaison.doubled
        if supervision is Supervision.ENDS:
            ends_ns = ends_ns or now_ns
            if not liaison.serving or silent or now_ns - ends_ns > _LINGER_NS:
                return 0
        child.beat()
        child.tick_status()
        child.sleep_until(now_ns + _TURN_NS)


def _supervision(child: Child) -> Supervision:
    if child.stop_requested or not child.supervisor_alive:
        return Supervision.ENDS
    return Supervision.WATCHES if child.supervisor_fresh else Supervision.SILENT


def _tell(child: Child, liaison: Liaison, now_ns: int, early: bool) -> None:
    state, detail = liaison.state(now_ns)
    if state is Lifecycle.READY:
        child.ready(detail)
    elif state is Lifecycle.STARTING and early:
        child.starting(detail)
    else:
        child.degrade(detail)
