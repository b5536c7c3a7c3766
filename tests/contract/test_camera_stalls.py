"""Network cameras whose link stalls for less than 2 s, at real sockets: what is shown has its right time."""

import contextlib
import socket
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager

import pytest

from drivers.camera.sources.opening import open_source
from drivers.camera.sources.reader_thread import Drain

PERIOD_S = 1 / 15
STALL_S = (1.4, 2.4)
LATE_S = 0.06
_HEAD = b"HTTP/1.0 200 OK\r\nContent-Type: multipart/x-mixed-replace; boundary=frame\r\n\r\n"


def part(number: int, stamped: bool) -> bytes:
    jpeg = b"\xff\xd8 %06d " % number + b"x" * 20_000 + b"\xff\xd9"
    stamp = b"X-Timestamp: %d.%06d\r\n" % divmod(round((1000.0 + number * PERIOD_S) * 1e6), 1_000_000)
    return b"--frame\r\nContent-Length: %d\r\n%s\r\n%s\r\n" % (len(jpeg), stamp * stamped, jpeg)


class Camera:
    """Sends pictures of a fixed cadence to its first client; what the stall holds back follows at 30 Mbit/s."""

    def __init__(self, stamped: bool, pictures: int = 50) -> None:
        self._stamped, self._pictures = stamped, pictures
        self._listener = socket.create_server(("127.0.0.1", 0))
        self.port = self._listener.getsockname()[1]
        self.began_s, self.taken_s = 0.0, list[float]()
        self.done = threading.Event()
        threading.Thread(target=self._serve, daemon=True).start()

    def _serve(self) -> None:
        with self._listener, self._listener.accept()[0] as client, contextlib.suppress(OSError):
            client.recv(4096)
            client.sendall(_HEAD)
            self.began_s = time.monotonic()
            for number in range(self._pictures):
                due_s = number * PERIOD_S
                due_s = STALL_S[1] if STALL_S[0] <= due_s < STALL_S[1] else due_s
                time.sleep(max(0.0, self.began_s + due_s - time.monotonic()))
                taken_s, sent_s = self.began_s + number * PERIOD_S, time.monotonic()
                # A picture is taken when it is sent, but for those that the stall kept back.
                self.taken_s.append(sent_s if sent_s < taken_s + PERIOD_S else taken_s)
                client.sendall(part(number, self._stamped))
                time.sleep(0.0055)
            self.done.set()


@contextmanager
def reading(camera: Camera) -> Iterator[Drain]:
    source = open_source(f"http://127.0.0.1:{camera.port}/")
    try:
        assert isinstance(source, Drain)
        yield source
    finally:
        source.close()


@pytest.mark.parametrize("stamped", [False, True])
def test_pictures_after_a_stall_have_their_right_times(stamped: bool) -> None:
    """They were dated by their arrival, up to a second too late."""
    camera, late_s = Camera(stamped), dict[int, float]()
    with reading(camera) as source:
        while not camera.done.is_set():
            packet = source.take_newest(0.1)
            if packet is not None:
                number = int(packet.data.split()[1])
                late_s[number] = packet.settled_ns / 1e9 - camera.taken_s[number]
        withheld = source.rejected["held_back"]
    assert max(late_s.values()) < LATE_S + PERIOD_S
    assert max(number * PERIOD_S for number in late_s) > STALL_S[1] + 0.5, "it goes on"
    assert withheld <= 1 if stamped else 10 <= withheld <= 22
