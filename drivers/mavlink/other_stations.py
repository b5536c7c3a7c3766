"""Notices that another ground station commands the vehicles of a link: its heartbeats, and answers to its commands.

Autopilots and routers forward frames from their other links. The commands of two stations conflict, and the heartbeat
of the other one hides the death of ours from the autopilot's own failsafe.
"""

from collections import Counter, deque
from collections.abc import Collection, Mapping

from drivers.mavlink.wire.flight import CommandAckMessage, CommandLong
from drivers.mavlink.wire.frames import Message, ReceivedFrame
from drivers.mavlink.wire.names import GCS_TYPE, MavCmd
from drivers.mavlink.wire.telemetry import OUR_HEARTBEAT, Heartbeat
from groundstation.time_units import NS_PER_S

REMEDY = "end it, or let it ride along (mavlink.forward): a second master moves vehicles against this one's orders"
_MOST = 16
# Requests that change nothing: every ground station makes them.
_HARMLESS = frozenset(
    (
        MavCmd.REQUEST_MESSAGE,
        MavCmd.SET_MESSAGE_INTERVAL,
        MavCmd.REQUEST_PROTOCOL_VERSION,
        MavCmd.REQUEST_AUTOPILOT_CAPABILITIES,
        MavCmd.GET_HOME_POSITION,
    )
)
_ALL_COMPONENTS = (0, 255)
# Longer than any retry, and than a slow radio keeps an answer.
_ANSWERED_NS = 10 * NS_PER_S


def speaks_as_we(frame: ReceivedFrame, own: tuple[int, int], rejected: Counter[str]) -> bool:
    """Return whether a frame carries our own ids; a heartbeat that we do not send is counted as that of another.

    WIRE (docs/reference/mavlink.md 5.11): ground stations have 255 and 190 by default. Radios and routers return our
    own frames, so frames alone prove nothing.
    """
    if (frame.system, frame.component) != own:
        return False
    if isinstance(frame.message, Heartbeat) and frame.message != OUR_HEARTBEAT:
        rejected["own_id"] += 1
    return True


def is_answer_to(own: tuple[int, int], ack: CommandAckMessage) -> bool:
    """Return whether an answer is addressed to us: our system and component, or all of either."""
    system, component = own
    if ack.target_system != system:
        return ack.target_system == 0
    return ack.target_component in (component, *_ALL_COMPONENTS)


class GivenOrders:
    """Notices that a vehicle answers orders under our ids that this driver never gave. Pure.

    forwards: another ground station, whose ids may be ours, may stop the vehicle through us. NAV_LAND does not count:
    supervisor and guardian send it for a driver that hangs.
    """

    def __init__(self, forwards: bool) -> None:
        self._forwards, self._told = forwards, False
        self._begun_ns: int | None = None
        self._given_ns: dict[int, int] = {}

    def note(self, now_ns: int, message: Message) -> None:
        """Take a message that this driver sends."""
        self._begun_ns = now_ns if self._begun_ns is None else self._begun_ns
        if isinstance(message, CommandLong):
            self._given_ns[message.command] = now_ns

    def is_foreign(self, now_ns: int, command: int) -> bool:
        """Take an answer to us; return, once, whether another station with our ids gave the order."""
        if self._told or self._forwards or self._begun_ns is None or command in (MavCmd.NAV_LAND, *_HARMLESS):
            return False
        # What came before may have been given by the driver before this one.
        self._told = now_ns - self._given_ns.get(command, self._begun_ns) > _ANSWERED_NS
        return self._told


class OtherStations:
    """Detects other ground stations on a link; `news` has (text, remedy) for the operator, each reported once.

    own: our system and component; riders: vehicles that another ground station may stop through us, whose answers are
    expected.
    """

    def __init__(self, own: tuple[int, int], names: Mapping[int, str], riders: Collection[int]) -> None:
        self._own, self._names, self._riders = own, names, riders
        self._told: set[tuple[object, ...]] = set()
        self.news: deque[tuple[str, str]] = deque(maxlen=_MOST)

    def take(self, frame: ReceivedFrame) -> None:
        """Take any verified frame of the link."""
        match frame.message:
            case Heartbeat(type=kind) if kind == GCS_TYPE and frame.system not in self._names:
                if (frame.system, frame.component) != self._own:
                    who = self._who(frame.system, frame.component)
                    self._tell((who,), f"another ground station is on this link ({who})")
            # A vehicle answers its own computers, and itself, under its own id.
            case CommandAckMessage() as ack if (
                not is_answer_to(self._own, ack) and ack.target_system not in self._names
            ):
                if frame.system in self._names and self._is_order(frame.system, ack.command):
                    who = self._who(ack.target_system, ack.target_component)
                    text = f"{self._names[frame.system]} answers orders of another ground station ({who})"
                    self._tell((frame.system, who), text)

    def _who(self, system: int, component: int) -> str:
        # Its component matters only where its system is ours.
        return f"system {system}, component {component}" if system == self._own[0] else f"system {system}"

    def _is_order(self, system: int, command: int) -> bool:
        return system not in self._riders and command not in _HARMLESS

    def _tell(self, what: tuple[object, ...], text: str) -> None:
        if what not in self._told and len(self._told) < _MOST:
            self._told.add(what)
            self.news.append((text, REMEDY))
