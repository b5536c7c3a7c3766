"""The client of a gateway: sends a request once a second, and passes on the rounds received."""

import select
import socket
from collections import Counter
from contextlib import suppress

from drivers.host_lookup import HostLookup
from drivers.ranging.wire import ranges
from groundstation.bus import clock
from groundstation.time_units import NS_PER_S

_ASK_AGAIN_NS = NS_PER_S
_DATAGRAMS = 64
# What a stall had held up comes one by one, and the reader is faster than that: the next follows within this time.
_NEXT_S, _MOST_READS = 0.003, 10


class Gateway:
    """One socket; rejected: refusals, by reason; failed: why its host's name has no address, or ""."""

    def __init__(self, host: str, port: int) -> None:
        self.rejected: Counter[str] = Counter()
        self._host, self._port = HostLookup(host), port
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.setblocking(False)
        self._asked_ns = self._heard_ns = 0

    @property
    def failed(self) -> str:
        """Return why the name of its host has no address, or ""."""
        return self._host.failed

    def poll(self, wait_s: float) -> list[tuple[int, ranges.Round]]:
        """Return the rounds received with their arrival [ns], the oldest first.

        Waits up to wait_s for the first, and then for what comes at once with it.
        """
        now_ns = clock.now_ns()
        if now_ns - self._asked_ns >= _ASK_AGAIN_NS:
            self._asked_ns = now_ns
            self._ask(now_ns)
        select.select([self._socket], [], [], wait_s)
        rounds = more = self._read()
        for _ in range(_MOST_READS):
            if not more:
                break
            select.select([self._socket], [], [], _NEXT_S)
            more = self._read()
            rounds = rounds + more
        return rounds

    def close(self) -> None:
        """Close the socket."""
        self._socket.close()

    def _ask(self, now_ns: int) -> None:
        if now_ns - self._heard_ns >= _ASK_AGAIN_NS:  # a silent gateway may have another address by now
            self._host.look_up()
        if self._host.found:
            with suppress(OSError):  # a network that is down now may be up later
                self._socket.sendto(ranges.ASK, (self._host.found[0], self._port))

    def _read(self) -> list[tuple[int, ranges.Round]]:
        rounds = []
        for _ in range(_DATAGRAMS):
            try:
                datagram, sender = self._socket.recvfrom(ranges.LARGEST + 1)
            except OSError:
                break
            if sender[0] not in self._host.found or sender[1] != self._port:
                self.rejected["stranger"] += 1
                continue
            self._heard_ns = clock.now_ns()
            try:
                rounds.append((self._heard_ns, ranges.decode(datagram)))
            except ranges.WireError as error:
                self.rejected[error.reason] += 1
        return rounds
