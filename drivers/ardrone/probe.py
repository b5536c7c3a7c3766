"""Looks at one AR.Drone without touching its flight: who it is, how it is, how it is set.

What is sent: navdata requests; questions over TCP; and, only to a drone that stands, COMWDG, CTRL and (out of the
bootstrap, where nobody else flies it) CONFIG general:navdata_demo. Never REF, PCMD or FTRIM. A drone in the air hears
no AT command at all: not even its watchdog is fed for whoever ought to fly it.
"""

import socket
import time
from collections.abc import Callable
from dataclasses import dataclass, field

from drivers.ardrone.desired_config import FULL_NAVDATA
from drivers.ardrone.dump import category, parse_dump
from drivers.ardrone.identity import Identity, Model, identity_from_dump, identity_from_version, model_from_navdata
from drivers.ardrone.queries import TcpInquirer
from drivers.ardrone.state_text import state_in_words, state_remedies
from drivers.ardrone.wire import at, navdata
from drivers.ardrone.wire.at import AtCommand
from drivers.ardrone.wire.errors import WireError
from drivers.ardrone.wire.navdata import Navdata
from drivers.ardrone.wire.options import DEMO
from drivers.ardrone.wire.state import StateBit, split_control_state
from groundstation.errors import DriverError

NAVDATA_PORT, AT_PORT, CONTROL_PORT, FTP_PORT = 5554, 5556, 5559, 5551
_ANSWER_S = 1.5
_LOOK_S = 0.6
_ACK_S = 0.5
_DUMP_S = 2.5
_TICK_S = 0.025
_LOW_BATTERY = 0.2
_SLOW_SHARE = 0.6
_LOSS = 0.9
_UNPAIRED = "00:00:00:00:00:00"


@dataclass(slots=True)
class NavdataStretch:
    """A stretch of navdata: its packets and duration; mode: bootstrap, demo or full."""

    mode: str
    rate_hz: float
    link_quality: float | None


@dataclass(slots=True)
class ProbeReport:
    """What was found; battery 0..1; config: key -> (value, category), both as text."""

    address: str
    identity: Identity = field(default_factory=Identity)
    state: int = 0
    phase: str = ""
    battery: float | None = None
    streams: list[NavdataStretch] = field(default_factory=list)
    rejected: int = 0
    config: dict[str, tuple[str, str]] = field(default_factory=dict)
    hints: list[str] = field(default_factory=list)

    @property
    def words(self) -> tuple[str, ...]:
        """Return the state bits in words."""
        return state_in_words(self.state)


class _Line:
    """Sockets to the drone, and the newest packet."""

    def __init__(self, address: str) -> None:
        self._address = address
        self._navdata, self._at = (socket.socket(socket.AF_INET, socket.SOCK_DGRAM) for _ in range(2))
        self._sequence = 1
        self._numbers: list[int] = []
        self.packet: Navdata | None = None
        self.demo_packet: Navdata | None = None
        self.rejected = 0
        self.speaking = False

    def close(self) -> None:
        self._navdata.close()
        self._at.close()

    def say(self, *commands: AtCommand) -> None:
        """Send AT commands, numbered from 1."""
        datagram = at.encode_datagram(commands, self._sequence)
        self._sequence += len(commands)
        self._at.sendto(datagram, (self._address, AT_PORT))

    def listen(self, seconds: float, until: Callable[[], bool] = lambda: False) -> bool:
        """Ask for navdata and take it for some seconds, or until something is so; returns whether it came true."""
        self._numbers.clear()
        deadline_s, request_s = time.monotonic() + seconds, 0.0
        while (now_s := time.monotonic()) < deadline_s:
            if now_s >= request_s and (self.packet is None or self.is_set(StateBit.NAVDATA_BOOTSTRAP)):
                request_s = now_s + 0.1
                self._navdata.sendto(navdata.REQUEST, (self._address, NAVDATA_PORT))
            if self.speaking:
                self.say(at.comwdg())
            self._take(now_s + _TICK_S)
            if until():
                return True
        return False

    def repeat(self, command: AtCommand, until: Callable[[], bool]) -> None:
        """Send a command again and again until something is so, at most for a while."""
        deadline_s = time.monotonic() + _ACK_S
        while not until() and time.monotonic() < deadline_s:
            self.say(command)
            self.listen(_TICK_S, until)

    def _take(self, until_s: float) -> None:
        while (left_s := until_s - time.monotonic()) > 0:
            self._navdata.settimeout(left_s)
            try:
                datagram, source = self._navdata.recvfrom(navdata.MAX_SIZE + 1)
            except TimeoutError:
                return
            if source[0] != self._address:
                continue
            try:
                self.packet = navdata.decode(datagram)
            except WireError:
                self.rejected += 1
                continue
            self._numbers.append(self.packet.sequence)
            if any(tag == DEMO.tag for tag, _ in self.packet.options):
                self.demo_packet = self.packet

    def is_set(self, bit: StateBit) -> bool:
        return self.packet is not None and bool(self.packet.state & bit)

    def stream(self, seconds: float) -> NavdataStretch:
        """Listen for some seconds and report the received navdata."""
        self.listen(seconds)
        mode = "demo" if self.is_set(StateBit.NAVDATA_DEMO) else "full"
        numbers = self._numbers
        expected = numbers[-1] - numbers[0] + 1 if numbers else 0
        quality = min(1.0, len(numbers) / expected) if expected > 0 else None
        return NavdataStretch(
            "bootstrap" if self.is_set(StateBit.NAVDATA_BOOTSTRAP) else mode, len(numbers) / seconds, quality
        )


def probe(address: str) -> ProbeReport:
    """Return the facts of the drone at an IPv4 address.

    Raises DriverError when it does not answer within 1.5 s or cannot be reached.
    """
    inquirer = TcpInquirer(address, FTP_PORT, CONTROL_PORT)
    line = _Line(address)
    try:
        inquirer.ask_version()
        if not line.listen(_ANSWER_S, lambda: line.packet is not None):
            raise DriverError(f"no AR.Drone answers at {address} (navdata, UDP {NAVDATA_PORT}) within {_ANSWER_S:g} s")
        report = ProbeReport(address)
        _look(line, report)
        version = inquirer.version
        if not line.is_set(StateBit.FLY):
            _ask(line, inquirer, report)
        _conclude(line, version or inquirer.version or "", report)
        return report
    except OSError as error:
        raise DriverError(f"{address} cannot be reached: {error.strerror or error}") from error
    finally:
        line.close()


def _look(line: _Line, report: ProbeReport) -> None:
    """Watch without sending; an idle drone on the ground is then asked for both kinds of navdata."""
    first = line.stream(_LOOK_S)
    if first.mode != "bootstrap" or line.is_set(StateBit.FLY):
        report.streams.append(first)
        return
    line.speaking = True
    for value in ("TRUE", FULL_NAVDATA.value):
        _configure(line, FULL_NAVDATA.key, value)
        report.streams.append(line.stream(_LOOK_S))


def _configure(line: _Line, key: str, value: str) -> None:
    _acknowledge(line)
    line.repeat(at.config(key, value), lambda: line.is_set(StateBit.COMMAND))
    _acknowledge(line)


def _acknowledge(line: _Line) -> None:
    line.repeat(at.ctrl(at.CTRL_ACK), lambda: not line.is_set(StateBit.COMMAND))


def _ask(line: _Line, inquirer: TcpInquirer, report: ProbeReport) -> None:
    line.listen(1.0, lambda: inquirer.version is not None)
    version, line.speaking = inquirer.version, True
    inquirer.ask_dump()
    line.listen(1.0, lambda: inquirer.listening or inquirer.dump is not None)
    line.say(at.ctrl(at.CTRL_CONFIG_GET))
    line.listen(_DUMP_S, lambda: inquirer.dump is not None)
    inquirer.version = version
    _acknowledge(line)
    stored = parse_dump(inquirer.dump or b"")
    report.config = {key: (value, category(key)) for key, value in stored.items()}


def _conclude(line: _Line, version: str, report: ProbeReport) -> None:
    assert line.packet is not None
    report.state, report.rejected = line.packet.state, line.rejected
    if line.demo_packet is not None:
        demo = line.demo_packet.read(DEMO)
        assert demo is not None
        report.battery = min(demo.battery_percent, 100) / 100
        report.phase = split_control_state(demo.control_state)[0].name
    values = {key: value for key, (value, _) in report.config.items()}
    told = [identity_from_version(version), identity_from_dump(values)]
    seen = Model.UNKNOWN if line.demo_packet is None else model_from_navdata(line.demo_packet)
    model = next((i.model for i in told if i.model is not Model.UNKNOWN), seen)
    firmware = next((i.firmware for i in told if i.firmware), "")
    report.identity = Identity(model, firmware, told[1].serial)
    report.hints += _hints(report, values)


def _hints(report: ProbeReport, values: dict[str, str]) -> list[str]:
    state, hints = report.state, list(state_remedies(report.state))
    low = report.battery is not None and report.battery < _LOW_BATTERY
    facts = (
        (low and not state & StateBit.VBAT_LOW, "the battery is low: charge it before the next flight"),
        (bool(state & StateBit.FLY), "in flight no command is sent, not even to ask: land it, then probe again"),
        (not state & StateBit.FLY and not report.config, "its control port (TCP 5559) gives no configuration"),
        (report.identity.model is Model.AR1, "its video (UVLC and P264 over UDP 5555) is out of scope here"),
        (any(s.link_quality is not None and s.link_quality < _LOSS for s in report.streams), "the radio loses packets"),
        (_is_slow(report), "navdata comes too slowly: does this computer scan for Wi-Fi networks?"),
        (report.rejected > 0, f"{report.rejected} packets were damaged"),
        (
            values.get("network:wifi_mode") == "0",
            'it is an access point of its own: see "Put several AR.Drones on one network" in docs/how-to',
        ),
        (
            values.get("network:owner_mac", _UNPAIRED) != _UNPAIRED,
            f"it is paired with {values.get('network:owner_mac')} and ignores everybody else",
        ),
    )
    return hints + [text for applies, text in facts if applies]


def _is_slow(report: ProbeReport) -> bool:
    nominal = {"demo": 200 / 13, "full": 200.0}
    return any(s.rate_hz < _SLOW_SHARE * nominal.get(s.mode, 0.0) for s in report.streams)
