"""Kernel arrival times of datagrams, independent of when the test reads them."""

import socket
import struct
import time

# SO_TIMESTAMPNS, as an option and as a datagram's ancillary message: seconds and nanoseconds of the wall clock.
_TIMESTAMPS, _TIMESPEC = 35, struct.Struct("@ll")
ANCILLARY = socket.CMSG_SPACE(_TIMESPEC.size)


class ArrivalTimes:
    """Reads the arrival times of one socket's datagrams; `recvmsg` needs `ANCILLARY` bytes of room for them."""

    def __init__(self, udp: socket.socket) -> None:
        udp.setsockopt(socket.SOL_SOCKET, _TIMESTAMPS, 1)
        self._from_wall_clock_s = time.monotonic() - time.time()

    def of(self, notes: list[tuple[int, int, bytes]]) -> float:
        """Return the arrival time from a datagram's ancillary data [s, monotonic]."""
        seconds, nanoseconds = _TIMESPEC.unpack(notes[0][2])
        return float(seconds + nanoseconds * 1e-9 + self._from_wall_clock_s)
