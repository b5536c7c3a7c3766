"""A third-party camera: MJPEG over HTTP, pictures drawn by the test."""

import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer

import cv2
import numpy as np

Draw = Callable[[], np.ndarray]


@contextmanager
def camera(draw: Draw, fps: float, delay_s: float = 0.0) -> Iterator[str]:
    """Serve the pictures of `draw`, each delayed by this time; yields the source."""

    class Handler(BaseHTTPRequestHandler):
        def do_GET(self) -> None:
            self.send_response(200)
            self.send_header("Content-Type", "multipart/x-mixed-replace; boundary=part")
            self.end_headers()
            with suppress(OSError):
                due = time.monotonic()
                while True:
                    self._send(cv2.imencode(".jpg", draw())[1].tobytes(), due + delay_s)
                    due = max(due + 1.0 / fps, time.monotonic())
                    time.sleep(max(0.0, due - time.monotonic()))

        def _send(self, jpeg: bytes, due: float) -> None:
            time.sleep(max(0.0, due - time.monotonic()))
            head = f"--part\r\nContent-Type: image/jpeg\r\nContent-Length: {len(jpeg)}\r\n\r\n"
            self.wfile.write(head.encode() + jpeg + b"\r\n")

        def log_message(self, *_: object) -> None:
            pass

    server = ThreadingHTTPServer(("127.0.0.1", 0), Handler)
    server.daemon_threads = True
    threading.Thread(target=server.serve_forever, daemon=True).start()
    try:
        yield f"http://127.0.0.1:{server.server_address[1]}/video.mjpg"
    finally:
        server.shutdown()
        server.server_close()
