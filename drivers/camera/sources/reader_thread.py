"""The thread behind every source: it reads continuously, reconnects after a loss, and keeps the newest unit.

A plain read loop would hand over pictures seconds old after a stall; draining keeps them as young as the link allows.
H.264, where a picture needs those before it, is decoded when the newest picture is requested, from the last place at
which a decoder can begin: a picture that nobody requests costs only its reading.
"""

import threading
from collections import Counter, deque
from collections.abc import Sequence
from typing import Protocol

from drivers.camera.sources.frames import Packet, Picture, Unit
from groundstation.errors import DriverError

_FIRST_BACK_OFF_S = 0.2
_LAST_BACK_OFF_S = 1.0
# 20 s at 30 pictures a second: a reader that is not polled for so long begins anew at the next key picture.
_BACKLOG = 600


class EndOfStreamError(DriverError):
    """A source that has ended: it is not opened again."""


class PictureDecoder(Protocol):
    """Turns units into pictures; needs_all: whether it must see every unit, in order, because they form a video."""

    needs_all: bool

    def newest(self, units: Sequence[Unit]) -> tuple[Unit, Picture] | None:
        """Return the newest picture that can be decoded of them, or None."""


class Reader(Protocol):
    """One kind of source."""

    name: str
    decoder: PictureDecoder | None
    rejected: Counter[str]

    def read(self, drain: "Drain") -> None:
        """Connect and hand units to `drain.keep` until `drain.closing`.

        Raises OSError or DriverError when the connection ends, EndOfStreamError when nothing more will ever come.
        """

    def interrupt(self) -> None:
        """Make a `read` that waits return soon; called from another thread."""


class Drain:
    """The `FrameSource` around a reader; reconnects with back-off for as long as it is open.

    `rejected` counts refusals, by reason.
    """

    def __init__(self, reader: Reader) -> None:
        self._reader = reader
        self._condition = threading.Condition()
        self._units: deque[Unit] = deque(maxlen=_BACKLOG)
        self._video: deque[Unit] = deque(maxlen=_BACKLOG)
        self._closing = threading.Event()
        self._connected = False
        self._detail = f"connecting to {reader.name}"
        self._received = 0
        self.rejected = reader.rejected
        self._thread = threading.Thread(target=self._read_for_ever, name="camera-drain", daemon=True)
        self._thread.start()

    @property
    def connected(self) -> bool:
        """Return whether the stream is open."""
        return self._connected

    @property
    def detail(self) -> str:
        """Return why it is not open."""
        return self._detail

    @property
    def received(self) -> int:
        """Return how many pictures have arrived, taken or not."""
        return self._received

    @property
    def closing(self) -> bool:
        """Return whether a reader has to stop."""
        return self._closing.is_set()

    def opened(self) -> None:
        """Note that the stream is open."""
        self._connected, self._detail = True, ""

    def keep(self, units: Sequence[Unit]) -> None:
        """Take in units, oldest first."""
        if not units:
            return
        with self._condition:
            self._received += len(units)
            held_back = sum(unit.held_back for unit in units)
            if held_back:
                self.rejected["held_back"] += held_back
            if not self._is_video:
                units = [unit for unit in units if not unit.held_back]
                if not units:
                    return
                self._units.clear()
            self._units.extend(units)
            self._condition.notify()

    def wait(self, seconds: float) -> bool:
        """Sleep in a reader; returns whether it has to stop."""
        return self._closing.wait(seconds)

    def take_newest(self, timeout_s: float) -> Packet | None:
        """Return the newest picture not yet taken, waiting for one at most that long."""
        with self._condition:
            if not self._units:
                self._condition.wait(timeout_s)
            units, number = list(self._units), self._received
            self._units.clear()
        if not units:
            return None
        decoder = self._reader.decoder
        if decoder is None:
            unit = units[-1]
            return Packet(unit.data, unit.arrival_ns, unit.settled_ns, number)
        if decoder.needs_all:
            self._video.extend(units)
        found = decoder.newest(units)
        if found is None:
            return None
        unit, picture = found
        if unit.held_back:
            return None
        return Packet(b"", unit.arrival_ns, unit.settled_ns, number, picture)

    def take_video(self) -> list[Unit]:
        """Return the access units up to the picture taken last; a source of JPEGs has none."""
        units = list(self._video)
        self._video.clear()
        return units

    def close(self) -> None:
        """Stop reading; idempotent."""
        self._closing.set()
        self._reader.interrupt()
        self._thread.join(timeout=3.0)

    @property
    def _is_video(self) -> bool:
        return self._reader.decoder is not None and self._reader.decoder.needs_all

    def _read_for_ever(self) -> None:
        back_off_s = _FIRST_BACK_OFF_S
        while not self.closing:
            before = self._received
            try:
                self._reader.read(self)
            except EndOfStreamError as error:
                self._connected, self._detail = False, f"{self._reader.name}: {error}"
                return
            except (OSError, DriverError) as error:
                self._detail = f"{self._reader.name}: {error}"
            except Exception as error:  # noqa: BLE001 - a reader may be anybody's program: its fault is told, and it goes on
                self._detail = f"{self._reader.name}: {type(error).__name__}: {error}"
            self._connected = False
            back_off_s = _FIRST_BACK_OFF_S if self._received > before else min(2 * back_off_s, _LAST_BACK_OFF_S)
            self._closing.wait(back_off_s)
