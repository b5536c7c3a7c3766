"""Inspects one AR.Drone without affecting its flight: identity, state and settings.

It sends navdata requests; queries over TCP; and, only to a standing drone, COMWDG, CTRL and (out of the bootstrap,
where nobody else flies it) CONFIG general:navdata_demo. Never REF, PCMD or FTRIM. A drone in the air gets no AT command
at all: even its watchdog is left to its pilot.
"""

from dataclasses import dataclass, field

from drivers.ardrone.conversation import CONTROL_PORT, FTP_PORT, Conversation, NavdataStretch
from drivers.ardrone.convert import charge_from_demo
from drivers.ardrone.desired_config import COM_WATCHDOG, FULL_NAVDATA
from drivers.ardrone.dump import category, differences
from drivers.ardrone.identity import Identity, Model, identity_from_dump, identity_from_version, model_from_navdata
from drivers.ardrone.network_setup import UNPAIRED
from drivers.ardrone.queries import TcpInquirer
from drivers.ardrone.state_text import state_in_words, state_remedies
from drivers.ardrone.wire.options import DEMO
from drivers.ardrone.wire.state import StateBit, split_control_state
from groundstation.errors import DriverError

_LOOK_S = 0.6
_LOW_BATTERY = 0.2
_SLOW_SHARE = 0.6
_LOSS = 0.9


@dataclass(slots=True)
class ProbeReport:
    """The findings; battery 0..1; config: key -> (value, category), both as text."""

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


def probe(address: str) -> ProbeReport:
    """Return the facts of the drone at an IPv4 address.

    Raises DriverError when it does not answer within 1.5 s or cannot be reached.
    """
    inquirer = TcpInquirer(address, FTP_PORT, CONTROL_PORT)
    line = Conversation(address)
    try:
        inquirer.ask_version()
        line.wait_for_answer()
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


def _look(line: Conversation, report: ProbeReport) -> None:
    """Listen without commands; then request both kinds of navdata of an idle drone on the ground."""
    first = line.stream(_LOOK_S)
    if first.mode != "bootstrap" or line.is_set(StateBit.FLY):
        report.streams.append(first)
        return
    line.speaking = True
    for value in ("TRUE", FULL_NAVDATA.value):
        line.configure(FULL_NAVDATA.key, value)
        report.streams.append(line.stream(_LOOK_S))


def _ask(line: Conversation, inquirer: TcpInquirer, report: ProbeReport) -> None:
    line.listen(1.0, lambda: inquirer.version is not None)
    version = inquirer.version
    stored = line.read_configuration(inquirer)
    inquirer.version = version
    report.config = {key: (value, category(key)) for key, value in stored.items()}


def _conclude(line: Conversation, version: str, report: ProbeReport) -> None:
    assert line.packet is not None
    report.state, report.rejected = line.packet.state, line.rejected
    if line.demo_packet is not None:
        demo = line.demo_packet.read(DEMO)
        assert demo is not None
        report.battery = charge_from_demo(demo)
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
            bool(differences([COM_WATCHDOG[:2]], values)),
            f"without commands it flies on for {values.get(COM_WATCHDOG.key)} s before it lands; the driver sets"
            f" {COM_WATCHDOG.key} to {COM_WATCHDOG.value}",
        ),
        (
            values.get("network:wifi_mode") == "0",
            'it is an access point of its own: see "Put several AR.Drones on one network" in docs/how-to',
        ),
        (
            values.get("network:owner_mac", UNPAIRED) != UNPAIRED,
            f"it is paired with {values.get('network:owner_mac')} and ignores everybody else",
        ),
    )
    return hints + [text for applies, text in facts if applies]


def _is_slow(report: ProbeReport) -> bool:
    nominal = {"demo": 200 / 13, "full": 200.0}
    return any(s.rate_hz < _SLOW_SHARE * nominal.get(s.mode, 0.0) for s in report.streams)
