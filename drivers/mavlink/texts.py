"""A vehicle's texts for the operator, joined from pieces, and jumps of its clock. Pure."""

from collections import deque

from drivers.mavlink.wire.names import MavSeverity
from drivers.mavlink.wire.telemetry import Statustext
from groundstation.time_units import NS_PER_MS, NS_PER_S

_PIECE = 50
_JUMP_MS = 1000
_PIECES = 8
_RECENT_S = 2
# An older text explains no present event; ArduPilot's comes just after the heartbeat with the mode.
_EXPLAINS_NS, _COMES_WITHIN_NS = 4 * NS_PER_S, 200 * NS_PER_MS
Said = tuple[int, str]  # severity 0 emergency .. 7 debug, text


class Texts:
    """Joins the pieces of long texts and remembers the last ones with their times.

    WIRE (STATUSTEXT, MAVLink 2): pieces of one text share an id other than 0; all but the last are full.
    """

    def __init__(self) -> None:
        self._pieces: dict[int, list[str]] = {}
        self._heard: deque[tuple[int, Said]] = deque(maxlen=32)

    def take(self, now_ns: int, message: Statustext) -> Said | None:
        """Take a piece; return the text that it completes, if any. A lost piece is left out."""
        text = message.text
        if message.id:
            pieces = self._pieces.setdefault(message.id, [])
            pieces.append(text)
            if len(text) >= _PIECE and len(pieces) < _PIECES:
                if len(self._pieces) > _PIECES:
                    del self._pieces[next(iter(self._pieces))]
                return None
            text = "".join(self._pieces.pop(message.id))
        text = text.rstrip()  # WIRE (PX4): a tab at the end marks a text also sent as an event
        self._heard.append((now_ns, (message.severity, text)))
        return message.severity, text

    def reasons(self, since_ns: int, word: str = "", now_ns: int | None = None) -> list[str]:
        """Return its distinct warnings since a time, oldest first; word: only those that contain it.

        now_ns: if given, add the age of those older than 2 s.
        """
        newest = {text: at for at, (level, text) in self._heard if at >= since_ns and level <= MavSeverity.WARNING}
        return [text + _age(at, now_ns) for text, at in newest.items() if word in text.lower()]


class Explanations:
    """Remembers the last texts of a vehicle: only those sent as it left our mode explain that."""

    def __init__(self) -> None:
        self._texts: deque[tuple[int, str]] = deque(maxlen=8)

    def take(self, now_ns: int, text: str) -> None:
        """Take a whole text."""
        self._texts.append((now_ns, text))

    def of(self, left_ns: int, now_ns: int) -> str:
        """Return, in brackets, the last text until a time, or "" if there is none or none that is recent."""
        texts = [(at, text) for at, text in self._texts if at <= left_ns + _COMES_WITHIN_NS]
        return f" ({texts[-1][1]})" if texts and now_ns - texts[-1][0] <= _EXPLAINS_NS else ""


def _age(at_ns: int, now_ns: int | None) -> str:
    age_s = 0 if now_ns is None else (now_ns - at_ns) // NS_PER_S
    return f" ({age_s} s ago)" if age_s > _RECENT_S else ""


class BootClock:
    """Compares a vehicle's time since power-on with our own clock.

    Its stamps serve no other purpose: measurements are stamped on arrival. restarted: its clock began anew since this
    was last set to False.
    """

    def __init__(self) -> None:
        self.restarted = False
        self._last: tuple[int, int] | None = None

    def take(self, now_ns: int, boot_ms: int) -> int:
        """Take a stamp; return its jump [ms], or 0; a gap in the link is no jump."""
        before, self._last = self._last, (now_ns, boot_ms)
        if before is None:
            return 0
        self.restarted = self.restarted or boot_ms < before[1] - _JUMP_MS
        jump = boot_ms - before[1] - (now_ns - before[0]) // 1_000_000
        return jump if abs(jump) > _JUMP_MS else 0
