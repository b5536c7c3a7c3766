"""A vehicle's texts for the operator, joined from pieces, and jumps of its clock. Pure."""

from collections import deque
from typing import NamedTuple

from drivers.mavlink.wire.names import MavSeverity
from drivers.mavlink.wire.telemetry import Statustext
from groundstation.time_units import NS_PER_MS, NS_PER_S

_PIECE = 50
_JUMP_MS = 1000
# Longer than radios keep frames while they are busy: a queue of 10 kB at 1 kB/s.
_KEPT_MS = 10_000
_PIECES = 8
_NEXT_WITHIN_NS = NS_PER_S // 2
_RECENT_S = 2
_RESTARTED = "it restarted, or two vehicles share its system id"
_STOOD = "it stood still, or its telemetry was held back"
# A refusal is reported only after its STATUSTEXT: the COMMAND_ACK arrives first.
_EXPLAIN_NS = 700 * NS_PER_MS
# An older text explains no present event; ArduPilot's comes just after the heartbeat with the mode.
_EXPLAINS_NS, _COMES_WITHIN_NS = 4 * NS_PER_S, 200 * NS_PER_MS


class Said(NamedTuple):
    """A whole text: when its first piece came, severity 0 emergency .. 7 debug."""

    at_ns: int
    severity: int
    text: str


class Texts:
    """Joins the pieces of long texts and remembers the last ones with their times.

    WIRE (docs/reference/mavlink.md 5.13): a vehicle sends its texts one after another; all pieces but the last are
    full, the last may be full too.
    """

    def __init__(self) -> None:
        self._pieces: list[Statustext] = []
        self._began_ns = self._came_ns = 0
        self._heard: deque[Said] = deque(maxlen=32)

    def whole(self, now_ns: int, pieces: deque[tuple[int, Statustext]]) -> list[Said]:
        """Take all pieces from a queue with their times; return the texts that are whole by now, the oldest first.

        A lost piece is left out.
        """
        said = []
        while pieces:
            said += self._take(*pieces.popleft())
        return said + (self._ended() if now_ns - self._came_ns >= _NEXT_WITHIN_NS else [])

    def _take(self, at_ns: int, piece: Statustext) -> list[Said]:
        last = self._pieces[-1] if self._pieces else None
        goes_on = last is not None and piece.id == last.id and piece.chunk_seq > last.chunk_seq
        said = [] if goes_on else self._ended()
        if not goes_on:
            self._began_ns = at_ns
        self._pieces.append(piece)
        self._came_ns = at_ns
        is_last = len(piece.text.encode()) < _PIECE or len(self._pieces) >= _PIECES
        return said + self._ended() if is_last else said

    def _ended(self) -> list[Said]:
        """Return the text of all waiting pieces, if it has any letters."""
        text = "".join(piece.text for piece in self._pieces).rstrip()  # WIRE (PX4): a tab marks one also sent as event
        said = [Said(self._began_ns, self._pieces[0].severity, text)] if text else []
        self._pieces.clear()
        self._heard.extend(said)
        return said

    def reasons(self, since_ns: int, word: str = "", now_ns: int | None = None) -> list[str]:
        """Return its distinct warnings since a time, oldest first; word: only those that contain it.

        now_ns: if given, add the age of those older than 2 s.
        """
        newest = {text: at for at, level, text in self._heard if at >= since_ns and level <= MavSeverity.WARNING}
        return [text + _age(at, now_ns) for text, at in newest.items() if word in text.lower()]


class Refusals:
    """Refused requests, which wait for the texts that explain them."""

    def __init__(self, texts: Texts) -> None:
        self._texts = texts
        self._waiting: deque[tuple[int, str]] = deque(maxlen=16)

    def told(self, now_ns: int, failures: deque[str]) -> list[str]:
        """Take all failures from a queue; return those whose texts have come by now, with these."""
        told = []
        while failures:
            self._waiting.append((now_ns, failures.popleft()))
        while self._waiting and now_ns - self._waiting[0][0] >= _EXPLAIN_NS:
            at_ns, text = self._waiting.popleft()
            reasons = self._texts.reasons(at_ns - _EXPLAIN_NS)
            told.append(f"{text} ({'; '.join(reasons)})" if reasons else text)
        return told


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
    was last set to False; why: what the last jump means, for the operator.
    """

    def __init__(self) -> None:
        self.restarted = False
        self.why = ""
        self._last: tuple[int, int] | None = None
        self._late_ms = 0

    def take(self, now_ns: int, boot_ms: int) -> int:
        """Take a stamp; return its jump [ms], or 0; a gap in the link is no jump.

        Nor are frames that a radio kept for some seconds, and those that come in time again.
        """
        before, self._last = self._last, (now_ns, boot_ms)
        if before is None:
            return 0
        jump = boot_ms - before[1] - (now_ns - before[0]) // 1_000_000
        # A clock that goes on after a pause, only behind, is that of no other vehicle.
        self.why = _STOOD if jump < 0 and boot_ms >= before[1] else _RESTARTED
        if boot_ms < before[1] - _JUMP_MS:
            self.restarted, self._late_ms = True, 0
            return jump
        excused, self._late_ms = self._late_ms, min(max(self._late_ms - jump, 0), _KEPT_MS)
        return 0 if -_KEPT_MS <= jump <= excused + _JUMP_MS else jump
