"""The process of one target's odometry: messages in; reports and status out. It sends nothing to the target."""

import math
import threading
from collections import Counter, deque

from drivers.base import HostProcess, read_section
from drivers.plausibility.clock_watch import ClockWatch
from drivers.rmw_zenoh.publisher_tie import PublisherTie
from drivers.rmw_zenoh.session import RouterSession
from drivers.rmw_zenoh.wire import graph, vehicle
from drivers.rmw_zenoh.wire.cdr import WireError
from drivers.stream_health import StreamHealth, StreamNames
from drivers.target_odometry.settings import OdometrySection, parse_source
from groundstation.bus import clock
from groundstation.bus.messages import ReportedMotion
from groundstation.bus.topics import REPORTED_MOTION
from groundstation.time_units import NS_PER_MS, NS_PER_S

_POLL_S, _WAITING = 0.02, 64
# The tracker gets reports no more often: neighbouring readings of one wheel err alike.
_PERIOD_NS = 45 * NS_PER_MS
# A message that repeats for this long is frozen, one this late is outdated [s].
_STANDS_S, _LATE_S = 0.3, 0.3
# Beyond a base's abilities it is no longer slip.
_MARGIN = 1.5


def run(child: HostProcess) -> int:
    """Receive from one target until a stop is requested; returns the exit code."""
    driver = OdometryDriver(child, read_section(OdometrySection, child.section, "odometry"))
    try:
        while not child.stop_requested and child.supervisor_alive:
            driver.turn()
    finally:
        driver.close()
    return 0


class OdometryDriver:
    """Turns one topic into messages; `turn` is one pass of its loop (at most 20 ms of waiting)."""

    def __init__(self, child: HostProcess, settings: OdometrySection) -> None:
        self._child, self._settings = child, settings
        self.counts: Counter[str] = Counter()
        self._waiting: deque[tuple[int, bytes, bytes]] = deque(maxlen=_WAITING)
        self._came = threading.Event()
        self._guard = OdometryGuard(_MARGIN * settings.max_speed_m_s)
        self._refused, self._told_ns = "", 0
        address = parse_source(settings.source)
        remedy = f"check the target's node, its router and {settings.source}; cameras track the target meanwhile"
        names = StreamNames("odometry", settings.name, "report", settings.source, remedy)
        self._health = StreamHealth(child, names, settings.start_within_s, settings.silent_after_s)
        expression = graph.heard_key(address.domain, address.topic, vehicle.ODOMETRY)
        self._session = RouterSession(f"tcp/{address.host}:{address.port}", [expression], self._hear)

    def turn(self) -> None:
        """Wait briefly for odometry, process it, and keep up heartbeat, status and the watch over silence."""
        self._came.wait(_POLL_S)
        self._came.clear()
        while self._waiting:
            self._handle(*self._waiting.popleft())
        why = self._refused if self._session.reaches_router else "no ROS 2 Zenoh router answers"
        self._health.end_turn(why, self._refused, self.counts)

    def close(self) -> None:
        """Leave the router."""
        self._session.close()

    def _hear(self, key: str, payload: bytes, publisher: bytes) -> None:
        self._waiting.append((clock.now_ns(), payload, publisher))
        self._came.set()

    def _handle(self, arrival_ns: int, payload: bytes, publisher: bytes) -> None:
        try:
            message = vehicle.decode_odometry(payload)
            self._refused = self._guard.refusal(arrival_ns, message, publisher)
        except WireError as error:
            self._refused = error.reason
        if self._refused:
            self.counts[self._refused] += 1
            return
        stamp_ns = arrival_ns - round(self._settings.delay_ms * NS_PER_MS + self._guard.late_s * NS_PER_S)
        self._health.came(arrival_ns)
        if stamp_ns - self._told_ns < _PERIOD_NS:
            return
        self._told_ns = stamp_ns
        self._health.used(stamp_ns)
        self._health.reported += 1
        header = self._child.bus.header(self._settings.target, stamp_ns)
        velocity, std_m_s = message.velocity[:2], self._settings.speed_std_m_s
        self._child.bus.publish(REPORTED_MOTION, ReportedMotion(header=header, velocity_m_s=velocity, std_m_s=std_m_s))


class OdometryGuard:
    """Refuses messages of one topic that cannot be true now: of a second publisher, too fast, frozen, or late. Pure.

    late_s: by how much the last one that was judged came later than the freshest ones.
    """

    def __init__(self, fastest_m_s: float) -> None:
        self.late_s = 0.0
        self._fastest_m_s = fastest_m_s
        self._clock = ClockWatch()
        self._tie = PublisherTie()
        self._told: tuple[object, ...] = ()
        self._changed_ns = 0

    def refusal(self, arrival_ns: int, message: vehicle.OdometryMessage, publisher: bytes) -> str:
        """Return why a message is not used, in words, or ""."""
        if self._tie.is_second(publisher, arrival_ns):
            return "second publisher"
        if self._tie.take(publisher, arrival_ns):
            self._clock.reset()
        if math.hypot(*message.velocity[:2]) > self._fastest_m_s:
            return "too fast"
        # A stamp of 0 counts as none: some nodes leave it out.
        stands_s, self.late_s = self._clock.update(arrival_ns, message.stamp_ns) if message.stamp_ns else (0.0, 0.0)
        if stands_s > _STANDS_S or self._repeats(arrival_ns, message):
            return "hangs"
        return "late" if self.late_s > _LATE_S else ""

    def _repeats(self, arrival_ns: int, message: vehicle.OdometryMessage) -> bool:
        """Return whether a moving target's message has repeated exactly for too long."""
        told = (message.position, message.quaternion, message.velocity, message.turn)
        if told != self._told:
            self._told, self._changed_ns = told, arrival_ns
        return any(message.velocity) and arrival_ns - self._changed_ns > _STANDS_S * NS_PER_S
