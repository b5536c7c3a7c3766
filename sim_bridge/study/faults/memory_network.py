"""UDP between drivers and emulated devices inside one thread: nothing leaves the process."""

import itertools
from collections import deque

Address = tuple[str, int]


class NothingWaits(BaseException):
    """Raised where a driver's reader would wait for the next datagram; no driver catches it."""


class MemoryNetwork:
    """Datagrams arrive at once, in the queue of the socket that is bound to their address."""

    def __init__(self) -> None:
        self._bound: dict[Address, MemorySocket] = {}
        self._ports = itertools.count(50_000)

    def socket(self, *_: object) -> "MemorySocket":
        """Return a new socket; takes the place of `socket.socket`."""
        return MemorySocket(self)

    def bind(self, udp: "MemorySocket", address: Address) -> Address:
        """Give an address to a socket: port 0 is any free one."""
        taken = (address[0], address[1] or next(self._ports))
        if taken in self._bound:
            raise OSError(98, "Address already in use")
        self._bound[taken] = udp
        return taken

    def deliver(self, data: bytes, source: Address, target: Address) -> None:
        """Deliver a datagram; one to an unbound address is lost."""
        if (udp := self._bound.get(target)) is not None:
            udp.waiting.append((data, source))

    def release(self, address: Address) -> None:
        """Free an address."""
        self._bound.pop(address, None)


class MemorySocket:
    """The part of a UDP socket that links use; where a blocking one would wait it raises `NothingWaits`."""

    def __init__(self, network: MemoryNetwork) -> None:
        self.waiting: deque[tuple[bytes, Address]] = deque(maxlen=4096)
        self._network, self._blocking = network, True
        self._address: Address | None = None

    def bind(self, address: Address) -> None:
        """Take an address; raises OSError when it is taken."""
        self._address = self._network.bind(self, address)

    def setblocking(self, blocking: bool) -> None:
        """Choose whether `recvfrom` may wait."""
        self._blocking = blocking

    def settimeout(self, _seconds: float) -> None:
        """Make it blocking, as the socket of a reader thread is."""
        self._blocking = True

    def setsockopt(self, *_: object) -> None:
        """Nothing to set."""

    def fileno(self) -> int:
        """Return -1: it is no socket of the operating system."""
        return -1

    def waits(self) -> bool:
        """Return True if a datagram waits; else raises NothingWaits, where a reader thread would wait."""
        if self.waiting:
            return True
        raise NothingWaits

    def recvfrom(self, _size: int) -> tuple[bytes, Address]:
        """Return the oldest datagram and its source."""
        if self.waiting:
            return self.waiting.popleft()
        if self._blocking:
            raise NothingWaits
        raise BlockingIOError

    def sendto(self, data: bytes, target: Address) -> int:
        """Send a datagram."""
        if self._address is None:
            self.bind(("", 0))
        assert self._address is not None
        self._network.deliver(bytes(data), self._address, target)
        return len(data)

    def close(self) -> None:
        """Give the address back."""
        if self._address is not None:
            self._network.release(self._address)
            self._address = None
