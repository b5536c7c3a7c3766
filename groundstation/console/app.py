"""The web application: the files, the token, and the WebSocket's two directions."""

import asyncio
import contextlib
import itertools
from collections import Counter
from collections.abc import Callable

from starlette.applications import Starlette
from starlette.requests import Request
from starlette.responses import PlainTextResponse, Response
from starlette.routing import Route, WebSocketRoute
from starlette.websockets import WebSocket, WebSocketDisconnect

from groundstation.console.access import KEEPS_ROLE, ROLE, DeviceDoor, Door, Gate
from groundstation.console.pages import StaticFile
from groundstation.console.protocol import Hello, decode
from groundstation.console.session import Sessions
from groundstation.console.snapshot import Snapshot
from groundstation.console.viewer import PageConnection
from groundstation.errors import MessageError

MAX_VIEWERS = 100
# Further places for the operator's pages, admitted only when all are taken, and a bound on pages asked at once.
_OPERATORS_PLACES = 4
_ASKED = 20
_ANSWER_S = 1.0
_CLOSE_POLICY, _CLOSE_FULL, _CLOSE_SLOW = 1008, 1013, 1013
_GONE = (WebSocketDisconnect, ConnectionError, RuntimeError)


class ConsoleApp:
    """Builds the ASGI applications: one for loopback, one for the network if it has a door.

    seed: takes a frame's number and returns all data for a new viewer.
    """

    def __init__(
        self,
        pages: dict[str, StaticFile],
        token: str,
        board: Snapshot,
        sessions: Sessions,
        seed: Callable[[int], str],
        clock: Callable[[], int],
        door: Door,
        network: DeviceDoor | None = None,
    ) -> None:
        self._pages, self._token, self._board, self._sessions, self._seed = pages, token, board, sessions, seed
        self._clock = clock
        self._numbers = itertools.count(1)
        self._asked = 0
        self.refused: Counter[str] = Counter()
        routes = [
            WebSocketRoute("/ws", self._socket),
            Route("/token", self._give_token),
            Route("/{path:path}", self._file),
        ]
        application = Starlette(routes=routes)
        self.asgi = Gate(application, door)
        self.network = Gate(application, network) if network else None

    async def _file(self, request: Request) -> Response:
        file = self._pages.get(request.url.path)
        if file is None:
            return PlainTextResponse("there is no such file", status_code=404)
        return Response(file.content, media_type=file.media_type)

    async def _give_token(self, _request: Request) -> Response:
        # For a page that outlived its server process. Other sites cannot read the answer.
        return PlainTextResponse(self._token)

    async def _socket(self, socket: WebSocket) -> None:
        await socket.accept()
        first = None
        if len(self._sessions.viewers) >= MAX_VIEWERS and (first := await self._operators_hello(socket)) is None:
            self.refused["full"] += 1
            with contextlib.suppress(*_GONE):
                await socket.close(_CLOSE_FULL, f"{MAX_VIEWERS} viewers are connected already")
            return
        viewer = PageConnection(next(self._numbers), self._board, socket.send_text, socket.send_bytes, self._clock)
        viewer.role = socket.scope[ROLE]
        self._sessions.add(viewer)
        if first is not None:
            self._sessions.handle(viewer, first)
        listening = asyncio.create_task(self._listen(socket, viewer))
        sending = asyncio.create_task(viewer.run(self._seed))
        try:
            await asyncio.wait({listening, sending}, return_when=asyncio.FIRST_COMPLETED)
        finally:
            self._sessions.remove(viewer)
            for task in (listening, sending):
                task.cancel()
            results = await asyncio.gather(listening, sending, return_exceptions=True)
            await self._farewell(socket, viewer, results[0])

    async def _operators_hello(self, socket: WebSocket) -> Hello | None:
        """Return a page's first message if it is the operator's, who is admitted even when all places are taken."""
        if self._asked >= _ASKED or len(self._sessions.viewers) >= MAX_VIEWERS + _OPERATORS_PLACES:
            return None
        self._asked += 1
        try:
            message = decode(await asyncio.wait_for(socket.receive_text(), _ANSWER_S))
        except (TimeoutError, KeyError, MessageError, *_GONE):
            return None
        finally:
            self._asked -= 1
        return message if isinstance(message, Hello) and self._sessions.is_operators(message) else None

    async def _listen(self, socket: WebSocket, viewer: PageConnection) -> str:
        """Serve the page until it leaves; returns the reason if it must leave."""
        while True:
            try:
                text = await socket.receive_text()
            except KeyError:
                return self._bad("binary")  # pages send no binary messages
            # Soon noticed on any page: one that says nothing gets a few more frames and no others.
            if not socket.scope[KEEPS_ROLE]():
                return self._bad("uninvited")
            if not viewer.may_speak():
                return self._bad("too_fast")
            try:
                message = decode(text)
            except MessageError as error:
                return self._bad(error.reason)
            self._sessions.handle(viewer, message)

    def _bad(self, reason: str) -> str:
        self.refused[reason] += 1
        return reason

    async def _farewell(self, socket: WebSocket, viewer: PageConnection, reason: object) -> None:
        try:
            if isinstance(reason, str):
                await socket.close(_CLOSE_POLICY, f"message refused: {reason}")
            elif viewer.too_slow:
                await socket.close(_CLOSE_SLOW, "too slow")
        except _GONE:
            pass  # it had left already
