"""Sends to a drone whose driver is dead or hangs: hover, and later land, in the drone's own protocol."""

import logging
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from enum import IntEnum

from groundstation.adapters import Address
from groundstation.supervisor.failsafe_transport import FailsafeTransport, Successor, open_transport
from groundstation.supervisor.process_spec import FailsafeDatagrams
from groundstation.time_units import NS_PER_MS, NS_PER_S

_PERIOD_NS = 100 * NS_PER_MS
_log = logging.getLogger(__name__)


class Speaker(IntEnum):
    """The sender for a driver; the driver itself is 1."""

    SUPERVISOR = 2
    GUARDIAN = 3


def unreachable(name: str, why: str) -> str:
    """Return that only its own driver reaches a vehicle, in the operator's words."""
    return f"{name} could not be landed without its driver: {why}"


@dataclass(slots=True)
class _Speech:
    datagrams: FailsafeDatagrams
    since_ns: int
    addresses: Sequence[Address]
    began_ns: int


class FailsafeSender:
    """Repeats the datagrams for each silent driver every 100 ms until ended."""

    def __init__(self, speaker: Speaker = Speaker.SUPERVISOR) -> None:
        self._speaker = speaker
        self._transports: dict[str, FailsafeTransport] = {}
        self._speaking: dict[str, _Speech] = {}
        self._failing: set[str] = set()
        self._next_ns = 0

    def prepare(self, name: str, datagrams: FailsafeDatagrams) -> str:
        """Open the transport to a driver's drone before it is needed; returns "" or the reason of a failure."""
        if name in self._transports:
            return ""
        try:
            self._transports[name] = open_transport(datagrams, self._speaker)
        except Exception as error:  # noqa: BLE001 - a transport may be another package's; the others go on
            return str(error) or type(error).__name__
        return ""

    def begin(
        self,
        name: str,
        datagrams: FailsafeDatagrams,
        since_ns: int,
        heard_at: Callable[[], Sequence[Address]] = tuple,
        left: Callable[[], int] = int,
    ) -> bool:
        """Start at once to send for a driver that has been silent since a time; returns whether that is new.

        Repeated with an earlier time, land comes earlier. heard_at: last addresses of vehicles that call their link;
        left: the number that the driver left.
        """
        if (speech := self._speaking.get(name)) is not None:
            speech.since_ns = min(speech.since_ns, since_ns)
            return False
        why = self.prepare(name, datagrams)
        if why:
            _log.error(unreachable(name, why))
        transport = self._transports.get(name)
        if isinstance(transport, Successor):
            transport.go_on_from(left())
        addresses = heard_at() if datagrams.called else ((datagrams.address, datagrams.port),)
        self._speaking[name] = _Speech(datagrams, since_ns, addresses, time.monotonic_ns())
        self._next_ns = 0
        return True

    def end(self, name: str) -> bool:
        """Stop sending for a driver; returns whether that is new."""
        return self._speaking.pop(name, None) is not None

    def began_ns(self, name: str) -> int:
        """Return since when it has been sending for a driver [ns]; 0: it does not, or has no working transport."""
        speech = self._speaking.get(name)
        return speech.began_ns if speech is not None and name in self._transports else 0

    def send_due(self, now_ns: int) -> None:
        """Send due datagrams; a lost link is no error, they are repeated anyway."""
        if now_ns < self._next_ns or not self._speaking:
            return
        self._next_ns = now_ns + _PERIOD_NS
        for name, speech in self._speaking.items():
            transport, datagrams = self._transports.get(name), speech.datagrams
            if transport is not None:
                too_long = now_ns - speech.since_ns >= datagrams.land_after_s * NS_PER_S
                self._send(name, transport, datagrams.land if too_long else datagrams.hover, speech.addresses)

    def _send(self, name: str, transport: FailsafeTransport, command: bytes, addresses: Sequence[Address]) -> None:
        """Send one command; a transport that fails, another package's included, must not silence the others."""
        try:
            transport.send(command, addresses)
        except OSError:
            return
        except Exception:  # noqa: BLE001 - it is logged once
            if name not in self._failing:
                _log.exception("the transport to %s failed", name)
            self._failing.add(name)

    def close(self) -> None:
        """Stop sending; idempotent."""
        self._speaking.clear()
        for transport in self._transports.values():
            transport.close()
        self._transports.clear()
