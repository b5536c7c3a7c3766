"""Lets supervisor and guardian reach vehicles whose driver is silent: signed, at addresses that called, or by a line.

No pymavlink here: the guardian is small. Reason: docs/decisions/0084-a-commanding-process-for-every-link.md.
"""

import json
import os
import socket
import time
from collections.abc import Iterator, Sequence

from drivers.mavlink.links.tty import open_raw
from drivers.mavlink.signing_clock import SigningClock
from drivers.mavlink.signing_key import read_key
from drivers.mavlink.wire.signature import frame_size, signed_anew
from groundstation.adapters import Address, bind_to_adapter, send_to_all
from groundstation.errors import DriverError

# Larger datagrams are fragmented on usual networks: one lost fragment would lose the orders to all vehicles.
_MOST_BYTES = 1200
# WIRE (ArduCopter 4.7; docs/reference/mavlink.md 5.3): 2 s after the last heartbeat it holds a landing until 4 s after
# that began, which is 0.5 s after the driver's last word. One that does not obey still lands by that failsafe.
HEARTBEATS_S = 3.0
# It sends many times a second: after such a pause it speaks for a driver anew.
_ANEW_S = 1.0


class MavlinkFailsafe:
    """Sends prepared frames; created before anything flies, because the key must be at hand when it is needed.

    For its first 3 s a heartbeat comes first. way: JSON with `serial` (DEVICE:BAUD, or "" for UDP), `key_file` ("" for
    unsigned frames), `interface` (network adapter, "" for any) and `heartbeat` (the frame, hexadecimal, "" for none).
    speaker: a distinct number for each process that may send, used as the signature's link id.
    """

    def __init__(self, way: str, speaker: int) -> None:
        told = json.loads(way)
        self._serial, key_file = str(told["serial"]), str(told["key_file"])
        self._key = read_key(key_file) if key_file else b""
        self._speaker, self._stamp, self._fd = speaker, 0, -1
        self._heartbeat = bytes.fromhex(str(told.get("heartbeat", "")))
        self._began_s = self._sent_s = -_ANEW_S
        self._clock = SigningClock()
        self._socket = None if self._serial else socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        if self._socket is not None:
            bind_to_adapter(self._socket, str(told.get("interface", "")))
            self._socket.setblocking(False)

    def go_on_from(self, left: int) -> None:
        """Sign with times newer than the newest that the driver sent or received (`MavlinkLink.newest_stamp`)."""
        self._stamp = max(self._stamp, left + 1)

    def send(self, datagram: bytes, addresses: Sequence[Address]) -> None:
        """Send frames to every address, or into the line; raises OSError if that fails."""
        datagram = self._due_heartbeat(time.monotonic()) + datagram
        if self._key:
            # WIRE (docs/reference/mavlink.md 5.9): times must grow for each sender and link, and a new link may begin
            # at most a minute before the newest time that the vehicle knows: one that its
            # driver sent or received. The clock is for a driver that recorded nothing.
            self._stamp = max(self._stamp, self._clock.stamp())
            datagram, self._stamp = signed_anew(datagram, self._key, self._speaker, self._stamp)
        if self._socket is None:
            self._write(datagram)
            return
        send_to_all(self._socket, tuple(_in_parts(datagram)), addresses)

    def _due_heartbeat(self, now_s: float) -> bytes:
        if now_s - self._sent_s >= _ANEW_S:
            self._began_s = now_s
        self._sent_s = now_s
        return self._heartbeat if now_s - self._began_s < HEARTBEATS_S else b""

    def _write(self, datagram: bytes) -> None:
        """Write into the device, opened beside or after the silent driver; after a failure it is reopened."""
        if self._fd < 0:
            device, _, baud = self._serial.partition(":")
            try:
                self._fd = open_raw(device, int(baud))
            except DriverError as error:
                raise OSError(str(error)) from error
        try:
            os.write(self._fd, datagram)
        except BlockingIOError:
            raise  # the device is full, but still works
        except OSError:
            os.close(self._fd)
            self._fd = -1
            raise

    def close(self) -> None:
        """Release the socket or device; idempotent."""
        if self._socket is not None:
            self._socket.close()
        if self._fd >= 0:
            os.close(self._fd)
            self._fd = -1


def _in_parts(frames: bytes) -> Iterator[bytes]:
    """Yield whole frames, as many at a time as fit into one unfragmented datagram."""
    begin = end = 0
    while end < len(frames):
        size = frame_size(frames, end)
        if end + size - begin > _MOST_BYTES and end > begin:
            yield frames[begin:end]
            begin = end
        end += size
    if frames:
        yield frames[begin:]
