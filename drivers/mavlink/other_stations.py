"""Notices that another ground station commands the vehicles of a link: its heartbeats, and answers to its commands.

Autopilots and routers forward frames from their other links. The commands of two stations conflict, and the heartbeat
of the other one hides the death of ours from the autopilot's own failsafe.
"""

from collections import Counter, deque
from collections.abc import Collection, Mapping

from drivers.mavlink.wire.flight import CommandAckMessage
from drivers.mavlink.wire.frames import ReceivedFrame
from drivers.mavlink.wire.names import GCS_TYPE, MavCmd
from drivers.mavlink.wire.telemetry import OUR_HEARTBEAT, Heartbeat

REMEDY = "end it, or let it ride along (mavlink.forward): a second master moves vehicles against this one's orders"
_MOST = 16
# Requests that change nothing: every ground station makes them.
_HARMLESS = frozenset(
    (
        MavCmd.REQUEST_MESSAGE,
        MavCmd.SET_MESSAGE_INTERVAL,
        MavCmd.REQUEST_PROTOCOL_VERSION,
        MavCmd.REQUEST_AUTOPILOT_CAPABILITIES,
    )
)


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


class OtherStations:
    """Detects other ground stations on a link; `news` has (text, remedy) for the operator, each reported once.

    own: our system id; riders: vehicles that another ground station may stop through us, whose answers are expected.
    """

    def __init__(self, own: int, names: Mapping[int, str], riders: Collection[int]) -> None:
        self._own, self._names, self._riders = own, names, riders
        self._told: set[tuple[int, ...]] = set()
        self.news: deque[tuple[str, str]] = deque(maxlen=_MOST)

    def take(self, frame: ReceivedFrame) -> None:
        """Take any verified frame of the link."""
        match frame.message:
            case Heartbeat(type=kind) if kind == GCS_TYPE and frame.system not in (self._own, *self._names):
                self._tell((frame.system,), f"another ground station is on this link (system {frame.system})")
            # A vehicle answers its own computers, and itself, under its own id.
            case CommandAckMessage(target_system=other) if other not in (0, self._own, *self._names):
                if frame.system in self._names and self._is_order(frame.system, frame.message.command):
                    text = f"{self._names[frame.system]} answers orders of another ground station (system {other})"
                    self._tell((frame.system, other), text)

    def _is_order(self, system: int, command: int) -> bool:
        return system not in self._riders and command not in _HARMLESS

    def _tell(self, what: tuple[int, ...], text: str) -> None:
        if what not in self._told and len(self._told) < _MOST:
            self._told.add(what)
            self.news.append((text, REMEDY))
