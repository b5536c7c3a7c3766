"""Video of vehicles that send H.264 as bare datagrams, all of them to one port of this computer."""

import socket
import struct
import time
from collections import Counter

from drivers.camera.sources.cut_pictures import Assembly
from drivers.camera.sources.frames import Unit
from drivers.camera.sources.h264 import H264Decoder
from drivers.camera.sources.held_back import Cadence
from drivers.camera.sources.reader_thread import Drain, PictureDecoder
from groundstation.adapters import bind_to_adapter
from groundstation.bus import clock
from groundstation.errors import DriverError

_SILENT_S, _LOOK_S = 2.0, 0.25
_LARGEST = 2048
_IP_PKTINFO = 8  # struct in_pktinfo: adapter, our address, the address that the datagram was sent to
_PACKET_INFO = struct.Struct("=i4s4s")


class DatagramReader:
    """Receives the video of one vehicle; several may share the port, each connected to the sender of its own datagrams.

    port: of this computer, that the vehicle sends to; whole_bytes: size of a datagram that does not end a picture.
    """

    def __init__(self, host: str, interface: str, port: int, whole_bytes: int) -> None:
        self._host, self._interface, self._port, self._whole_bytes = host, interface, port, whole_bytes
        self.name = f"{host} (UDP {port})"
        self.rejected: Counter[str] = Counter()
        self.decoder: PictureDecoder | None = H264Decoder(self.rejected)

    def interrupt(self) -> None:
        """Make `read` return: it checks four times a second."""

    def read(self, drain: Drain) -> None:
        """Hand over pictures until the drain closes."""
        own = self._find(drain)
        if own is None:
            return
        with own as udp:
            drain.opened()
            assembly, heard_s = Assembly(self._whole_bytes), time.monotonic()
            cadence = Cadence()
            while not drain.closing:
                try:
                    done = assembly.feed(udp.recv(_LARGEST))
                except TimeoutError:
                    _none_since(heard_s)
                    continue
                heard_s = time.monotonic()
                now_ns = clock.now_ns()
                drain.keep(
                    [
                        Unit(unit.data, now_ns, now_ns, unit.starts, held_back=cadence.holds_back(now_ns))
                        for unit in done
                    ]
                )
                self.rejected["bytes"] += assembly.skipped
                assembly.skipped = 0

    def _find(self, drain: Drain) -> socket.socket | None:
        """Return a socket that receives from this vehicle only, once it sends.

        The kernel passes other datagrams to other sockets. The port that it sends from is undocumented, and only a
        datagram shows to which of our addresses it sends.
        """
        with self._bound(("", self._port)) as udp:
            udp.setsockopt(socket.IPPROTO_IP, _IP_PKTINFO, 1)
            began_s = time.monotonic()
            while not drain.closing:
                try:
                    _, extra, _, source = udp.recvmsg(_LARGEST, socket.CMSG_SPACE(_PACKET_INFO.size))
                except TimeoutError:
                    _none_since(began_s)
                    continue
                if source[0] == self._host and extra:
                    _, _, ours = _PACKET_INFO.unpack(extra[0][2][: _PACKET_INFO.size])
                    own = self._bound((socket.inet_ntoa(ours), self._port))
                    own.connect(source)
                    return own
        return None

    def _bound(self, place: tuple[str, int]) -> socket.socket:
        udp = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        bind_to_adapter(udp, self._interface)
        udp.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        udp.settimeout(_LOOK_S)
        udp.bind(place)
        return udp


def _none_since(heard_s: float) -> None:
    if time.monotonic() - heard_s > _SILENT_S:
        raise DriverError(f"no video for {_SILENT_S:g} s: does its driver run?")
