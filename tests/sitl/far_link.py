"""A link between two network namespaces with delay and loss, for kernels without netem.

Each end is a TUN adapter; a thread carries the packets from one to the other, late, and drops some: TCP and UDP behave
as on a bad network.
"""

import ctypes
import fcntl
import heapq
import os
import random
import select
import struct
import subprocess
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress

_TUNSETIFF, _TUN_NO_INFO = 0x400454CA, 0x1001
_NEWNET = 0x40000000
_PACKET = 65536
_libc = ctypes.CDLL(None, use_errno=True)


def _checked(result: int) -> None:
    if result:
        raise OSError(ctypes.get_errno(), os.strerror(ctypes.get_errno()))


def ip(order: str) -> None:
    """Run `ip` with these arguments."""
    subprocess.run(["ip", *order.split()], check=True)


class Namespace:
    """A new network namespace, held open by this process."""

    def __init__(self) -> None:
        self._here = os.open("/proc/self/ns/net", os.O_RDONLY)
        _checked(_libc.unshare(_NEWNET))
        self._there = os.open("/proc/self/ns/net", os.O_RDONLY)
        ip("link set lo up")
        _checked(_libc.setns(self._here, 0))

    @property
    def path(self) -> str:
        """Path for other programs."""
        return f"/proc/{os.getpid()}/fd/{self._there}"

    @contextmanager
    def entered(self) -> Iterator[None]:
        """Create sockets and adapters in it, in this thread."""
        _checked(_libc.setns(self._there, 0))
        try:
            yield
        finally:
            _checked(_libc.setns(self._here, 0))


def _tun(name: str, address: str) -> int:
    descriptor = os.open("/dev/net/tun", os.O_RDWR | os.O_NONBLOCK)
    fcntl.ioctl(descriptor, _TUNSETIFF, struct.pack("16sH", name.encode(), _TUN_NO_INFO))
    ip(f"addr add {address}/24 dev {name}")
    ip(f"link set {name} up")
    return descriptor


class FarLink:
    """Connects this namespace with another one; delay_s: each way. `cut` ends the link for good."""

    def __init__(self, there: Namespace, ends: tuple[str, str], delay_s: float, loss: float, seed: int = 1) -> None:
        near = _tun("far", ends[0])
        with there.entered():
            self._across = {near: _tun("far", ends[1])}
        self._across |= {other: one for one, other in self._across.items()}
        self._delay_s, self._loss, self._random = delay_s, loss, random.Random(seed)
        self.carried = self.lost = 0
        self.cut = threading.Event()
        threading.Thread(target=self._carry, daemon=True).start()

    def _carry(self) -> None:
        waiting: list[tuple[float, int, int, bytes]] = []
        while not self.cut.is_set():
            left_s = max(0.0, waiting[0][0] - time.monotonic()) if waiting else 0.1
            for descriptor in select.select(list(self._across), (), (), min(left_s, 0.1))[0]:
                self._take(descriptor, waiting)
            while waiting and waiting[0][0] <= time.monotonic():
                _, _, sink, packet = heapq.heappop(waiting)
                with suppress(OSError):
                    os.write(sink, packet)

    def _take(self, descriptor: int, waiting: list[tuple[float, int, int, bytes]]) -> None:
        with suppress(BlockingIOError):
            while packet := os.read(descriptor, _PACKET):
                self.carried += 1
                if self._random.random() < self._loss:
                    self.lost += 1
                    continue
                heapq.heappush(
                    waiting, (time.monotonic() + self._delay_s, self.carried, self._across[descriptor], packet)
                )
