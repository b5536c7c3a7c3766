"""Serves the form of a new field file on loopback, until the file is written."""

import asyncio
import contextlib
import signal
import socket
from pathlib import Path

import msgspec
from starlette.applications import Starlette
from starlette.requests import Request
from starlette.responses import PlainTextResponse, Response
from starlette.routing import Route, WebSocketRoute
from starlette.websockets import WebSocket, WebSocketDisconnect

from groundstation.console.access import Door, Gate
from groundstation.console.code_file import CodeFile
from groundstation.console.half_open import HalfOpen, protocol
from groundstation.console.new_field.answers import decode, offers_script, reply_to
from groundstation.console.pages import StaticFile, files_of
from groundstation.console.web_server import serve
from groundstation.errors import MessageError

_PACKAGE = "groundstation.console.new_field"
_FAREWELL_S = 0.3


class FormServer:
    """The form's page and its WebSocket, for the field file at `path`."""

    def __init__(self, path: Path, listener: socket.socket) -> None:
        self._path, self._listener = path, listener
        self._code = CodeFile(listener.getsockname()[1])
        console = files_of("groundstation.console")
        self._files = files_of(_PACKAGE) | {name: console[name] for name in ("/style.css", "/icon.svg")}
        self._files["/offers.js"] = StaticFile(offers_script(), "text/javascript")
        routes = [WebSocketRoute("/ws", self._socket), Route("/{path:path}", self._file)]
        self.asgi = Gate(Starlette(routes=routes), Door(self._code.code, str(self._code.path)))
        self.url = f"http://127.0.0.1:{listener.getsockname()[1]}/"
        self._over = asyncio.Event()
        self._written = False

    async def serve(self) -> bool:
        """Serve until the file is written, or a signal ends it; return whether it was written."""
        loop = asyncio.get_running_loop()
        for number in (signal.SIGINT, signal.SIGTERM):
            loop.add_signal_handler(number, self._over.set)
        server, serving = serve(self.asgi, self._listener, protocol(HalfOpen()))
        with self._code:
            over = asyncio.create_task(self._over.wait())
            await asyncio.wait({serving, over}, return_when=asyncio.FIRST_COMPLETED)
            await asyncio.sleep(_FAREWELL_S if self._written else 0.0)
            server.should_exit = True
            await serving
        return self._written

    async def _file(self, request: Request) -> Response:
        path = request.url.path
        file = self._files.get("/index.html" if path == "/" else path)
        if file is None:
            return PlainTextResponse("there is no such file", status_code=404)
        return Response(file.content, media_type=file.media_type)

    async def _socket(self, socket: WebSocket) -> None:
        await socket.accept()
        with contextlib.suppress(WebSocketDisconnect, ConnectionError, RuntimeError):
            while not self._over.is_set():
                frame = await socket.receive()
                if frame["type"] != "websocket.receive":
                    return
                try:
                    answers = decode(frame.get("text") or frame.get("bytes") or b"")
                except MessageError:
                    await socket.close(1008, "not the form's answers")
                    return
                reply = await asyncio.to_thread(reply_to, answers, self._path)
                await socket.send_text(msgspec.json.encode(reply).decode())
                if reply.written:
                    self._written = True
                    self._over.set()
