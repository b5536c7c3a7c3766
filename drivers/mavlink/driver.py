"""The MAVLink driver: one port, one reader thread, a watchdog per vehicle, and the process entry `run`."""

import logging
import sys
import threading
from collections import Counter, deque
from collections.abc import Sequence

from drivers.base import HostProcess, read_section
from drivers.host import VehicleHost, run_hosts
from drivers.mavlink import line_load
from drivers.mavlink.line_watch import LineWatch
from drivers.mavlink.links.forwarding import with_riders
from drivers.mavlink.links.opening import open_link
from drivers.mavlink.links.seam import Heard, MavlinkLink
from drivers.mavlink.other_stations import OtherStations
from drivers.mavlink.settings import MavlinkDriverSettings
from drivers.mavlink.signing_key import read_key
from drivers.mavlink.vehicle import MavlinkVehicle
from drivers.mavlink.wire import frames
from drivers.mavlink.wire.names import NO_AUTOPILOT, MavSeverity
from drivers.mavlink.wire.signature import MAGIC_1
from drivers.mavlink.wire.telemetry import Heartbeat
from drivers.start_report import StartReport
from groundstation.bus.messages import Estimate, Severity
from groundstation.bus.topics import ESTIMATE
from groundstation.errors import DriverError
from groundstation.process.priority import go_first
from groundstation.time_units import NS_PER_S

# Rate of work that is due by the clock: poses, requests, status. Orders do not wait for a turn.
RATE_HZ = 100.0
# How long one thread may keep the others from the interpreter: Python's default of 5 ms is a setpoint's whole budget.
_SWITCH_S = {"pymavlink": 0.0005, "mavsdk": 0.005}
_SAME_TEXT_NS = 10 * NS_PER_S
_log = logging.getLogger(__name__)


class Fleet:
    """All vehicles of one link. Frames go to the vehicle with their system id.

    Other ids are counted, and named once.
    """

    def __init__(self, child: HostProcess, settings: MavlinkDriverSettings) -> None:
        faults = frames.dialect_faults()
        if faults:
            raise DriverError(f"this pymavlink knows other messages than we do: {'; '.join(faults)}")
        if fault := line_load.fault(settings):
            raise DriverError(f"{settings.link.target} {fault}")
        self._child = child
        self._estimates = child.bus.subscribe([ESTIMATE], newest=True)
        self.vehicles: dict[int, MavlinkVehicle] = {}
        self._news: deque[tuple[str, str]] = deque(maxlen=16)
        if caution := line_load.caution(settings):
            self._tell(f"{settings.link.target} {caution}", "")
        shown = {vehicle.system_id: vehicle for vehicle in settings.vehicles}
        key = read_key(settings.link.key_file) if settings.link.key_file else b""
        self.link: MavlinkLink = open_link(
            settings.link, self._sniff, lambda transport: with_riders(transport, shown, self._tell, key)
        )
        self.vehicles = {v.system_id: MavlinkVehicle(settings, v, self.link, child.bus) for v in settings.vehicles}
        self._stations = OtherStations(
            (settings.link.system_id, settings.link.component_id),
            {vehicle.system_id: vehicle.name for vehicle in settings.vehicles},
            [vehicle.system_id for vehicle in settings.vehicles if vehicle.forward],
        )
        self._line_watch = LineWatch() if settings.link.target.startswith("serial") else None
        self.strangers: Counter[int] = Counter()
        self._announced: dict[tuple[str, str], int] = {}
        self._closing = threading.Event()
        self._reader = threading.Thread(target=self._read, name="mavlink", daemon=True)
        self._reader.start()

    def _sniff(self, system: int, stamp_ns: int, data: bytes, received: bool) -> None:
        vehicle = self.vehicles.get(system)
        if vehicle is not None:
            if received and data[0] == MAGIC_1:
                vehicle.misfit.take_old(stamp_ns)
            (vehicle.log.received if received else vehicle.log.sent)(stamp_ns, data)

    def _tell(self, text: str, remedy: str) -> None:
        self._news.append((text, remedy))

    def _read(self) -> None:
        while not self._closing.is_set():
            try:
                for heard in self.link.receive():
                    self._hand_on(heard)
            except Exception:  # noqa: BLE001 - the reader must outlive whatever arrives: count, log, go on
                if self._closing.is_set():
                    return
                self.link.rejected["internal"] += 1
                _log.exception("a frame could not be used")

    def _hand_on(self, heard: Heard) -> None:
        self._stations.take(heard.frame)
        vehicle = self.vehicles.get(heard.frame.system)
        if vehicle is not None:
            vehicle.take(heard)
        elif isinstance(heard.frame.message, Heartbeat) and heard.frame.message.autopilot != NO_AUTOPILOT:
            self.strangers[heard.frame.system] += 1
            self.link.rejected["unknown_system"] += 1
            for vehicle in self.vehicles.values():
                vehicle.misfit.take_stranger(heard.stamp_ns, heard.frame.system)
            if self.strangers[heard.frame.system] == 1:
                text = f"system {heard.frame.system} answers, which is not in the field file"
                if silent := [v.name for v in self.vehicles.values() if v.telemetry.fell_silent(heard.stamp_ns)]:
                    text += f", since {' and '.join(silent)} fell silent: was a system id changed?"
                self._news.append((text, "see system_id in the field file"))

    def turn(self, now_ns: int) -> None:
        """Pass the tracker's estimate to the vehicles, and their events to the operator."""
        for received in self._estimates.drain():
            if isinstance(received.message, Estimate):
                for vehicle in self.vehicles.values():
                    vehicle.see(now_ns, received.message)
        self._child.note_addresses(self.link.called_from)
        self._child.leave(self.link.newest_stamp)
        if self._line_watch is not None:
            self._news.extend(self._line_watch.news(now_ns, self.link.rejected))
        for news in (self._news, self._stations.news):
            while news:
                self._child.event(Severity.WARNING, *news.popleft())
        for vehicle in self.vehicles.values():
            while vehicle.orders.events:
                self._announce(now_ns, vehicle.name, *vehicle.orders.events.popleft())

    def _announce(self, now_ns: int, name: str, severity: int, text: str) -> None:
        last_ns = self._announced.get((name, text))
        if last_ns is not None and now_ns - last_ns < _SAME_TEXT_NS:
            return
        self._announced = {said: at for said, at in self._announced.items() if now_ns - at < _SAME_TEXT_NS}
        self._announced[name, text] = now_ns
        level = Severity.INFO
        if severity <= MavSeverity.WARNING:
            level = Severity.ERROR if severity <= MavSeverity.ERROR else Severity.WARNING
        self._child.event(level, f"{name}: {text}", "", name)

    def close(self) -> None:
        """Stop the reader and close the port."""
        self._closing.set()
        self._reader.join(timeout=1.0)
        self.link.close()
        for vehicle in self.vehicles.values():
            vehicle.flush()


def share_interpreter(settings: MavlinkDriverSettings) -> None:
    """Set how long the threads of this process may keep each other waiting."""
    sys.setswitchinterval(_SWITCH_S[settings.link.kind])


def hosts_of(child: HostProcess, fleet: Fleet, settings: MavlinkDriverSettings) -> Sequence[VehicleHost]:
    """Return a host, with its own watchdog, for each vehicle; its setpoints wake the process."""
    start = StartReport(child, [v.name for v in settings.vehicles])
    hosts = [VehicleHost(child, fleet.vehicles[v.system_id], settings.authority(v), start) for v in settings.vehicles]
    for host in hosts:
        host.call_on_setpoints(child.wake)
    return hosts


def run(child: HostProcess) -> int:
    """Fly the vehicles of one link until asked to stop; the process entry."""
    settings = read_section(MavlinkDriverSettings, child.section, "MAVLink")
    share_interpreter(settings)
    fleet = Fleet(child, settings)
    try:
        go_first()
        return run_hosts(child, hosts_of(child, fleet, settings), RATE_HZ, fleet.turn)
    finally:
        fleet.close()
