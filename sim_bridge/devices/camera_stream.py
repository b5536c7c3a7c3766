"""The network side of an emulated camera: MJPEG over HTTP.

WIRE: multipart/x-mixed-replace with a JPEG per part, Content-Type and Content-Length, as IP cameras and mjpg-streamer
send it. The exposure time is not sent: the receiver has to know the camera's delay.
"""

from sim_bridge.devices.stream_server import Client, StreamServer

_BOUNDARY = b"skeinframe"
PATH = "/video.mjpg"
_HEAD = (
    b"HTTP/1.0 200 OK\r\nConnection: close\r\nCache-Control: no-store\r\nPragma: no-cache\r\n"
    b"Content-Type: multipart/x-mixed-replace; boundary=" + _BOUNDARY + b"\r\n\r\n"
)
_NOT_FOUND = (
    b"HTTP/1.0 404 Not Found\r\nContent-Type: text/plain\r\nConnection: close\r\n\r\nthe picture is at /video.mjpg\n"
)
_MAX_REQUEST = 4096


def part(jpeg: bytes) -> bytes:
    """Return one frame as a multipart part."""
    head = b"--%s\r\nContent-Type: image/jpeg\r\nContent-Length: %d\r\n\r\n" % (_BOUNDARY, len(jpeg))
    return head + jpeg + b"\r\n"


class CameraStream(StreamServer):
    """Serves frames at http://address:port/video.mjpg."""

    def send_at(self, release_ns: int, jpeg: bytes) -> None:
        """Hand a frame to all clients at a monotonic time [ns]; frames leave in the order of their times."""
        self._hand_over(release_ns, part(jpeg), stands_alone=True)

    def _greet(self, client: Client) -> None:
        """Wait for the request."""

    def _hear(self, client: Client, data: bytes) -> bool:
        if client.streaming or client.closing:
            return True
        client.request += data
        if b"\r\n\r\n" in client.request:
            words = client.request.split(b"\r\n", 1)[0].split()
            known = len(words) >= 2 and words[0] == b"GET" and words[1].split(b"?")[0] == PATH.encode()
            client.streaming, client.closing = known, not known
            client.pending = memoryview(_HEAD if known else _NOT_FOUND)
            self._flush(client)
        return len(client.request) <= _MAX_REQUEST
