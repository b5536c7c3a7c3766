"""Annotated pictures for a browser: MJPEG over HTTP, on loopback only."""

import threading
from contextlib import suppress
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer

from groundstation.errors import OperatorMistake

_HOST = "127.0.0.1"
_BOUNDARY = "skein"
_MOST_VIEWERS = 4
_PAUSE_S = 1.0


class PictureServer:
    """Serves the newest picture to each viewer until it is closed; `show` never waits for one."""

    def __init__(self, port: int) -> None:
        self._changed = threading.Condition()
        self._jpeg, self._number, self._viewers, self._open = b"", 0, 0, True
        try:
            self._server = ThreadingHTTPServer((_HOST, port), self._handler())
        except OSError as error:
            raise OperatorMistake(f"port {port} cannot be used ({error.strerror}): --port gives another") from None
        self._server.daemon_threads = True
        self._thread = threading.Thread(target=self._server.serve_forever, name="camera-view", daemon=True)
        self._thread.start()

    @property
    def url(self) -> str:
        """Return the address of the pictures."""
        return f"http://{_HOST}:{self._server.server_address[1]}/video.mjpg"

    def show(self, jpeg: bytes) -> None:
        """Show a picture to all viewers."""
        with self._changed:
            self._jpeg, self._number = jpeg, self._number + 1
            self._changed.notify_all()

    def close(self) -> None:
        """Stop the server."""
        with self._changed:
            self._open = False
            self._changed.notify_all()
        self._server.shutdown()
        self._server.server_close()
        self._thread.join(timeout=2.0)

    def _newer_than(self, number: int) -> tuple[int, bytes]:
        """Return the number and the JPEG of the newest picture, waiting at most a second; b"" when there is none."""
        with self._changed:
            self._changed.wait_for(lambda: self._number > number or not self._open, timeout=_PAUSE_S)
            return (self._number, self._jpeg) if self._number > number else (number, b"")

    def _handler(self) -> type[BaseHTTPRequestHandler]:
        stream = self

        class Handler(BaseHTTPRequestHandler):
            """One viewer."""

            timeout = 5.0

            def do_GET(self) -> None:
                """Answer with pictures for as long as there are any."""
                if stream._viewers >= _MOST_VIEWERS:
                    self.send_error(503, "enough are looking")
                    return
                stream._viewers += 1
                try:
                    with suppress(OSError):
                        self._serve()
                finally:
                    stream._viewers -= 1

            def _serve(self) -> None:
                self.send_response(200)
                self.send_header("Content-Type", f"multipart/x-mixed-replace; boundary={_BOUNDARY}")
                self.send_header("Cache-Control", "no-store")
                self.end_headers()
                number = 0
                while stream._open:
                    number, jpeg = stream._newer_than(number)
                    if jpeg:
                        head = f"--{_BOUNDARY}\r\nContent-Type: image/jpeg\r\nContent-Length: {len(jpeg)}\r\n\r\n"
                        self.wfile.write(head.encode() + jpeg + b"\r\n")

            def log_message(self, format: str, *args: object) -> None:
                """Log nothing."""

        return Handler
