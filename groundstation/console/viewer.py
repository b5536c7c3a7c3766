"""One viewer: sends its frames, newest first, with a limit on unacknowledged ones."""

import asyncio
import time
from collections import deque
from collections.abc import Awaitable, Callable

import msgspec

from groundstation.console.devices import DeviceRole
from groundstation.console.snapshot import Snapshot
from groundstation.time_units import NS_PER_MS

# Number of unacknowledged frames on the way; the page answers each fourth, and each while it watches pictures. 12 are
# 0.6 s. No more than a few may be before a picture, or behind it while one takes long: they would wait for it.
WINDOW, _FEW = 12, 4
# Number of unacknowledged pictures: one, and one more after each that was quickly acknowledged.
_PICTURES_AT_ONCE, _QUICK_NS = 8, 200 * NS_PER_MS
_URGENT = 64
_RATE_PER_S = 60.0
_BURST = 120.0


class PicturesUnderWay:
    """The pictures that a page has not acknowledged; it does so by a later frame."""

    def __init__(self) -> None:
        self._sent: deque[tuple[int, int]] = deque()  # number of the frame before each, time
        self._at_once = 1

    @property
    def has_room(self) -> bool:
        """Return whether another one may be sent."""
        return len(self._sent) < self._at_once

    @property
    def window(self) -> int:
        """Return how many frames may be under way."""
        return _FEW if self._sent and self._at_once == 1 else WINDOW

    def sent(self, after_seq: int, now_ns: int) -> None:
        """Note that one was sent after a frame."""
        self._sent.append((after_seq, now_ns))

    def saw(self, seq: int, now_ns: int) -> None:
        """Note that frames up to this one were handled."""
        while self._sent and self._sent[0][0] < seq:
            _, sent_ns = self._sent.popleft()
            quick = now_ns - sent_ns < _QUICK_NS
            self._at_once = min(_PICTURES_AT_ONCE, self._at_once + 1) if quick else 1


class PageConnection:
    """The data waiting for one page. `run` sends; the other methods only add data.

    Telemetry and pictures wait as "newest" and replace each other; notices and answers wait in order, and a viewer
    with too many of these is too slow to be helped.
    """

    def __init__(
        self,
        number: int,
        board: Snapshot,
        send_text: "SendText",
        send_bytes: "SendBytes",
        clock: Callable[[], int] = time.monotonic_ns,
    ) -> None:
        self.number = number
        self.name = f"viewer {number}"
        self.client = ""
        self.trusted = False
        self.role = DeviceRole.COMMAND
        self.too_slow = self.keeps_end = False
        self.watched: frozenset[str] = frozenset()
        self.skipped = 0
        self._board = board
        self._clock = clock
        self._send_text, self._send_bytes = send_text, send_bytes
        self._urgent: deque[str] = deque()
        self._pictures: dict[str, bytes] = {}
        self._under_way = PicturesUnderWay()
        self._wake = asyncio.Event()
        self._seq = self._seen = 0
        self._answer: Answer | None = None
        self._turn = -1
        self._unseeded = True
        self._allowance, self._allowance_at = _BURST, time.monotonic()

    @property
    def is_behind(self) -> bool:
        """Return whether the board has unsent sections."""
        return self._turn < self._board.turn

    def notice(self) -> None:
        """Note that the board has changed."""
        self._wake.set()

    def reseed(self) -> None:
        """Send everything once more: earlier data belong to another time."""
        self._unseeded = True
        self._pictures.clear()
        self._wake.set()

    def say(self, text: str) -> None:
        """Send this in any case, before telemetry."""
        self.too_slow = self.too_slow or len(self._urgent) >= _URGENT
        self._urgent.append(text)
        self._wake.set()

    def show(self, camera: str, frame: bytes) -> None:
        """Send this picture, unless a newer one of the camera comes first."""
        if camera in self.watched:
            self._pictures[camera] = frame
            self._wake.set()

    def hear(self, sent_ms: float | None) -> None:
        """Note when the page sent a message, to be answered with the time of its arrival."""
        if sent_ms is not None:
            self._answer = sent_ms, self._clock() / NS_PER_MS

    def take_answer(self) -> "Answer | None":
        """Return the page's time of its newest message and ours of its arrival [ms]; of each message once."""
        answer, self._answer = self._answer, None
        return answer

    def saw(self, seq: int) -> None:
        """Note that the page has handled frames up to this one."""
        self._seen = max(self._seen, min(seq, self._seq))
        self._under_way.saw(self._seen, time.monotonic_ns())
        self._wake.set()

    def may_speak(self) -> bool:
        """Return whether the page keeps to the permitted rate of messages."""
        now = time.monotonic()
        self._allowance = min(_BURST, self._allowance + (now - self._allowance_at) * _RATE_PER_S)
        self._allowance_at = now
        self._allowance -= 1.0
        return self._allowance >= 0.0

    async def run(self, seed: Callable[[int], str]) -> None:
        """Send a seed, then changes, until cancelled; `seed` takes the frame's number."""
        await self._send_newest(seed)
        while not self.too_slow:
            await self._wake.wait()
            self._wake.clear()
            while self._urgent:
                await self._send_text(self._urgent.popleft())
            if self._seq - self._seen < self._under_way.window:
                await self._send_newest(seed)
            else:
                self.skipped += 1

    async def _send_newest(self, seed: Callable[[int], str]) -> None:
        if self._unseeded:
            self._unseeded = False
            self._turn = self._board.turn
            self._seq += 1
            await self._send_text(seed(self._seq))
        elif self.is_behind:
            sections = self._board.since(self._turn)
            self._turn = self._board.turn
            self._seq += 1
            await self._send_text(delta(self._seq, self._clock(), sections, self.take_answer()))
        if self._pictures and self._under_way.has_room and self._seq - self._seen <= _FEW:
            camera = next(iter(self._pictures))
            self._under_way.sent(self._seq, time.monotonic_ns())
            await self._send_bytes(self._pictures.pop(camera))
            self._wake.set()  # one at a time: on a link slower than the pictures, words and figures come in between


def delta(seq: int, now_ns: int, sections: bytes, answer: "Answer | None" = None) -> str:
    """Return a frame of the changed sections, with the server's time."""
    told = f'"answer":{msgspec.json.encode(answer).decode()},' if answer else ""
    return f'{{"type":"delta","seq":{seq},"now":{now_ns / NS_PER_MS:.3f},{told}"s":{sections.decode()}}}'


Answer = tuple[float, float]
SendText = Callable[[str], Awaitable[None]]
SendBytes = Callable[[bytes], Awaitable[None]]
