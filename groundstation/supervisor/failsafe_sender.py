"""Speaks to a drone whose driver is dead or hangs: hover, and after a while land, in the drone's own protocol."""

import socket
from contextlib import suppress

from groundstation.supervisor.process_spec import FailsafeDatagrams
from groundstation.time_units import NS_PER_S

_PERIOD_NS = 100_000_000


class FailsafeSender:
    """Repeats the datagrams of each silent driver every 100 ms until they are called off."""

    def __init__(self) -> None:
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.setblocking(False)
        self._speaking: dict[str, tuple[FailsafeDatagrams, int]] = {}
        self._next_ns = 0

    def begin(self, name: str, words: FailsafeDatagrams, since_ns: int) -> bool:
        """Start to speak, at once, for a driver that is silent since then; returns whether that is news."""
        if name in self._speaking:
            return False
        self._speaking[name] = (words, since_ns)
        self._next_ns = 0
        return True

    def end(self, name: str) -> bool:
        """Leave the word to the driver again; returns whether that is news."""
        return self._speaking.pop(name, None) is not None

    def send_due(self, now_ns: int) -> None:
        """Send what is due; a lost link is no error, the words are repeated anyway."""
        if now_ns < self._next_ns or not self._speaking:
            return
        self._next_ns = now_ns + _PERIOD_NS
        for words, since_ns in self._speaking.values():
            too_long = now_ns - since_ns >= words.land_after_s * NS_PER_S
            with suppress(OSError):
                self._socket.sendto(words.land if too_long else words.hover, (words.address, words.port))

    def close(self) -> None:
        """Fall silent; idempotent."""
        self._speaking.clear()
        self._socket.close()
