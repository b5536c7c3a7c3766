"""Draws a Tello's own video and sends it to the client that asked for it."""

import heapq
import socket
import threading
import time
from contextlib import suppress
from multiprocessing.connection import Connection

from drivers.tello.wire.text import VIDEO_PORT
from groundstation.arrays import Array
from groundstation.time_units import NS_PER_S
from sim_bridge.devices.h264 import GreyStream
from sim_bridge.render.spec import RenderSpec
from sim_bridge.render.wrong_pictures import WrongPictures

# WIRE (docs/reference/tello.md 4): the vehicle's own choice lies between 1 and 4 Mbit/s.
_BIT_RATE = 2e6
_WHOLE_BYTES = 1460


class TelloOutput:
    """H.264 over UDP, in the size of the camera's calibration."""

    def __init__(self, spec: RenderSpec, modes: Connection | None) -> None:
        self._modes, self._peer = modes, ""
        self._accepting = self._wants_key = True
        size = (spec.intrinsics.width_px, spec.intrinsics.height_px)
        self._renderer = WrongPictures(spec)
        self._stream = GreyStream(size, spec.scenario.fps, _BIT_RATE)
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.bind((spec.address, 0))
        self._later: list[tuple[int, str, bytes]] = []
        self._news, self._closing = threading.Condition(), False
        self._thread = threading.Thread(target=self._send_later, name="tello-video", daemon=True)
        self._thread.start()

    @property
    def clients(self) -> int:
        """Return 1 once a client has asked for the video, else 0."""
        while self._modes is not None and self._modes.poll():
            try:
                told = self._modes.recv()
            except EOFError:
                self._modes = None
                break
            self._peer, self._wants_key = (told[0], True) if told else ("", True)
        return int(bool(self._peer) and self._accepting)

    def set_accepting(self, accepting: bool) -> None:
        """Send nothing (False), or send again (True)."""
        self._accepting = accepting

    def show(self, states: Array, exposure_ns: int, release_ns: int, now_s: float) -> None:
        """Draw the true states and send the picture at a time [ns]; now_s: since the first true state."""
        unit, _ = self._stream.encode(self._renderer.render(states, now_s), self._wants_key)
        self._wants_key = False
        with self._news:
            heapq.heappush(self._later, (release_ns, self._peer, unit))
            self._news.notify()

    def _send_later(self) -> None:
        while not self._closing:
            with self._news:
                wait_s = (self._later[0][0] - time.monotonic_ns()) / NS_PER_S if self._later else None
                if wait_s is None or wait_s > 0.0:
                    self._news.wait(wait_s)
                    continue
                _, peer, unit = heapq.heappop(self._later)
            for datagram in cut(unit):
                with suppress(OSError):  # nobody listens there yet
                    self._socket.sendto(datagram, (peer, VIDEO_PORT))

    def close(self) -> None:
        """Stop sending."""
        with self._news:
            self._closing = True
            self._news.notify()
        self._thread.join(timeout=1.0)
        self._socket.close()


def cut(data: bytes) -> list[bytes]:
    """Return the datagrams of a picture; if the last is full a zero byte, which a stream may have, makes one more."""
    data += b"" if len(data) % _WHOLE_BYTES else b"\x00"
    return [data[place : place + _WHOLE_BYTES] for place in range(0, len(data), _WHOLE_BYTES)]
