"""Records the datagrams to an AR.Drone's command port on the loopback interface, from any sender."""

import ctypes
import re
import socket
import struct
import threading
from collections import defaultdict

from arrival_times import ANCILLARY, ArrivalTimes

_AT_PORT = 5556
_OUTGOING = 4  # PACKET_OUTGOING: the loopback interface shows each datagram twice
_ATTACH_FILTER = 26  # SO_ATTACH_FILTER
_MOTION = re.compile(rb"AT\*PCMD(?:_MAG)?=-?\d+,(\d+)")
_REFERENCE = re.compile(rb"AT\*REF=-?\d+,(\d+)")
# Classic BPF: IPv4, UDP, destination port 5556; everything else stays in the kernel.
_PROGRAM = (
    (0x28, 0, 0, 12), (0x15, 0, 6, 0x0800), (0x30, 0, 0, 23), (0x15, 0, 4, 17),
    (0xB1, 0, 0, 14), (0x48, 0, 0, 16), (0x15, 0, 1, _AT_PORT), (0x06, 0, 0, 0x40000), (0x06, 0, 0, 0),
)  # fmt: skip


class WireTap:
    """Records (time of arrival [s], moves, lands) of each datagram, by the drone's address; needs CAP_NET_RAW."""

    def __init__(self) -> None:
        self.heard: defaultdict[str, list[tuple[float, bool, bool]]] = defaultdict(list)
        self._socket = socket.socket(socket.AF_PACKET, socket.SOCK_RAW, socket.htons(3))
        self._socket.bind(("lo", 0))
        self._socket.settimeout(0.2)
        program = b"".join(struct.pack("HBBI", *step) for step in _PROGRAM)
        self._program = ctypes.create_string_buffer(program, len(program))
        option = struct.pack("HL", len(_PROGRAM), ctypes.addressof(self._program))
        self._socket.setsockopt(socket.SOL_SOCKET, _ATTACH_FILTER, option)
        self._times = ArrivalTimes(self._socket)
        self._closing = threading.Event()
        self._thread = threading.Thread(target=self._listen, daemon=True)
        self._thread.start()

    def _listen(self) -> None:
        while not self._closing.is_set():
            try:
                frame, notes, _, source = self._socket.recvmsg(4096, ANCILLARY)
            except TimeoutError:
                continue
            if source[2] != _OUTGOING:
                self._note(self._times.of(notes), frame)

    def _note(self, now: float, frame: bytes) -> None:
        motion, reference = _MOTION.search(frame), _REFERENCE.search(frame)
        moves = motion is not None and bool(int(motion[1]) & 1)
        lands = reference is not None and not int(reference[1]) & (1 << 9)
        self.heard[socket.inet_ntoa(frame[30:34])].append((now, moves, lands))

    def last_motion(self, address: str, since: float, until: float) -> float | None:
        """Return the time of the drone's last motion command in a span of time [s after its start]."""
        return max((at - since for at, moves, _ in self.heard[address] if since <= at < until and moves), default=None)

    def first_stop(self, address: str, since: float) -> float | None:
        """Return the time of the drone's first hover or landing command [s after]."""
        return next((at - since for at, moves, _ in self.heard[address] if at >= since and not moves), None)

    def first_landing(self, address: str, since: float) -> float | None:
        """Return the time of the drone's first landing command [s after]."""
        return next((at - since for at, _, lands in self.heard[address] if at >= since and lands), None)

    def close(self) -> None:
        """Stop listening."""
        self._closing.set()
        self._thread.join()
        self._socket.close()
