"""The console's loop: bus in, board out, twenty times a second; uvicorn serves in the same event loop."""

import asyncio
import secrets
import socket
from collections import Counter
from collections.abc import Callable, Iterable
from typing import Any

import msgspec

from groundstation.bus import clock
from groundstation.bus.api import Bus, Received
from groundstation.bus.messages import ALL_DOWN, SOME_UNHEARD, Command, CommandAck, Event, Lease, RelativeObservation
from groundstation.bus.topics import (
    CAMERA_STATUS,
    COMMAND,
    COMMAND_ACK,
    ESTIMATE,
    EVENT,
    IMAGE,
    INNOVATION,
    LEASE,
    OBSERVATION,
    PLAN,
    PREFLIGHT,
    PROCESS_STATUS,
    SEARCH_MAP,
    SETPOINT,
    SIM_STATUS,
    SUSPICION,
    TRUTH,
    VEHICLE_STATUS,
)
from groundstation.console.access import Door
from groundstation.console.app import ConsoleApp
from groundstation.console.code_file import CodeFile
from groundstation.console.commands import CommandDesk
from groundstation.console.half_open import HalfOpen, PeerLimit, protocol
from groundstation.console.network import Network
from groundstation.console.pages import load_pages
from groundstation.console.pictures import PictureDesk
from groundstation.console.player import Player
from groundstation.console.room import lenses_of
from groundstation.console.run_end import REPORT_PATH, RunEnd
from groundstation.console.session import Sessions
from groundstation.console.snapshot import Snapshot
from groundstation.console.state import NO_CAMERAS, ConsoleState
from groundstation.console.web_server import serve
from groundstation.errors import GroundStationError
from groundstation.field.resolved import ResolvedField
from groundstation.monitor.state import Cast

RATE_HZ = 20
HOST = "127.0.0.1"
_PORTS_TRIED = 10
_FAREWELL_S = 0.5
# For devices behind a slow radio; pages on this host hold a report within a tenth of a second.
_KEEPING_S = 3.0
# Small, so that frames wait here, where the newest wins, not in the kernel.
_SEND_BUFFER_BYTES = 64 * 1024
_NEWEST = (ESTIMATE,)
# Read in every other turn: arrows and crosses at 10 Hz are enough, and decoding is most of this process's work.
_LESS_OFTEN = (
    PLAN,
    VEHICLE_STATUS,
    CAMERA_STATUS,
    PROCESS_STATUS,
    SETPOINT,
    SIM_STATUS,
    PREFLIGHT,
    SUSPICION,
    SEARCH_MAP,
)
_EACH = (EVENT, COMMAND, COMMAND_ACK, LEASE, OBSERVATION, INNOVATION)
# Of these only the newest message counts.
STATES = (*_NEWEST, *_LESS_OFTEN, TRUTH)
TOPICS = (*STATES, *_EACH, IMAGE)


def claim_port(port: int, address: str = HOST) -> socket.socket:
    """Return a socket listening at this port, or one of the next nine, or any; two runs at once work."""
    for number in (*range(port, min(port + _PORTS_TRIED, 65536)), 0):
        listener = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
        listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        listener.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, _SEND_BUFFER_BYTES)
        try:
            listener.bind((address, number))
            listener.listen(128)
        except OSError:
            listener.close()
            continue
        return listener
    raise GroundStationError(f"no port of {address} can be listened on: is it an address of this computer?")


class ConsoleServer:
    """Serves one run. `scene`: the static scene; `field`: the resolved field, or None if unknown.

    run: its identity (`section.run_id`), which pages name in their orders; player: the replay of a recording on the
    bus, if this is no live run; network: access for devices, if any.
    """

    def __init__(
        self,
        bus: Bus,
        cast: Cast,
        scene: dict[str, Any],
        field: ResolvedField | None,
        listener: socket.socket,
        run: str,
        player: Player | None = None,
        network: Network | None = None,
    ) -> None:
        self._network = network
        self._scene = scene
        self._listener = listener
        self._cast, self._bus, self._player = cast, bus, player
        self._lenses = lenses_of(field) if field else {}
        self._now_ns = player.now_ns if player else clock.now_ns
        self.url = f"http://{HOST}:{listener.getsockname()[1]}/"
        self.board = Snapshot()
        self._cameras = field.cameras if field else NO_CAMERAS
        self.state = ConsoleState(cast, self._now_ns(), self._cameras)
        self._pictures = PictureDesk(self._lenses)
        token = secrets.token_urlsafe(24)
        steered = cast.targets if scene["truth"] and player is None else ()
        desk = CommandDesk(bus, tuple(cast.drones))
        self.sessions = Sessions(bus, desk, token, run, steered, lambda: self._pictures.frames, player)
        self.half_open, self.peers = HalfOpen(), PeerLimit()
        self._code = CodeFile(listener.getsockname()[1])
        door = Door(self._code.code, str(self._code.path))
        self._pages = load_pages(token, run)
        self.app = ConsoleApp(
            self._pages,
            token,
            self.board,
            self.sessions,
            self._seed,
            self._now_ns,
            door,
            network.door if network else None,
        )
        self._run = run
        self._end: Event | None = None
        self._result: RunEnd | None = None
        self.closed = False
        less_often = (*_LESS_OFTEN, TRUTH) if scene["truth"] else _LESS_OFTEN
        self._newest = bus.subscribe(_NEWEST, newest=True)
        self._less_often = bus.subscribe(less_often, newest=True)
        self._each = bus.subscribe(_EACH, capacity=2048)
        self._images = bus.subscribe((IMAGE,), newest=True)

    @property
    def ended(self) -> bool:
        """Return whether the run was announced to end."""
        return self._end is not None

    @property
    def refused(self) -> dict[str, int]:
        """Return the counts of refused requests and connections, by reason."""
        devices = self.app.network.refused if self.app.network else Counter[str]()
        refused = {"silent": self.half_open.ended, "crowd": self.peers.refused, "device": devices["other_user"]}
        return {**refused, **self.app.asgi.refused, "other_site": (self.app.asgi.refused + devices)["other_site"]}

    @property
    def overflowed(self) -> int:
        """Return the number of messages lost because they came too fast."""
        return self._each.overflowed

    async def serve(self, go_on: Callable[[int, int], bool], end: Callable[[], RunEnd | None] = lambda: None) -> None:
        """Serve until `go_on(turns, late turns)`, called in each turn, returns False; then show `end` to open pages."""
        servers = [serve(self.app.asgi, self._listener, protocol(self.half_open))]
        if self._network is not None and self.app.network is not None:
            http = protocol(self.half_open, self.peers)
            servers.append(serve(self.app.network, self._network.listener, http, self._network))
        try:
            with self._code:
                await self._turns(go_on, servers[0][1])
                await self._say_farewell(end())
        finally:
            for server, _ in servers:
                server.should_exit = True
            await asyncio.gather(*(serving for _, serving in servers))

    async def _turns(self, go_on: Callable[[int, int], bool], serving: "asyncio.Task[None]") -> None:
        loop = asyncio.get_running_loop()
        period_s, due_s, turns, late = 1.0 / RATE_HZ, loop.time(), 0, 0
        while go_on(turns, late) and not serving.done():
            self.turn(self._now_ns())
            turns += 1
            due_s += period_s
            if due_s < loop.time():
                late += 1
                due_s = loop.time()
            await asyncio.sleep(due_s - loop.time())

    async def _say_farewell(self, end: RunEnd | None) -> None:
        """Tell the viewers how the run ended, and let them keep its report, before their connections close."""
        self._result = end
        if end is not None and end.report is not None:
            self._pages[REPORT_PATH] = end.report
        self.turn(self._now_ns())
        loop = asyncio.get_running_loop()
        give_up_s = loop.time() + (_FAREWELL_S if end is None else _KEEPING_S)
        while self.ended and loop.time() < give_up_s and self._is_anybody_behind(end is not None):
            await asyncio.sleep(0.01)

    def _is_anybody_behind(self, judged: bool) -> bool:
        return any(viewer.is_behind or (judged and not viewer.keeps_end) for viewer in self.sessions.viewers.values())

    def turn(self, now_ns: int) -> None:
        """Take in new messages and update the viewers."""
        self.take_in(now_ns)
        self.board.begin()
        self.state.put(self.board, now_ns)
        self._put_own(now_ns)
        for viewer in self.sessions.viewers.values():
            viewer.notice()

    def take_in(self, now_ns: int) -> None:
        """Take in messages that arrived up to a time."""
        self.ingest(self._newest.drain(), now_ns)
        if self._player is not None or self.board.turn % 2:
            self.ingest(self._less_often.drain(), now_ns)
        self.ingest(self._each.drain(), now_ns)
        self.sessions.desk.step(now_ns, self.state.doing())
        self.sessions.operator_lock.step(now_ns)
        self._take_pictures(now_ns)
        self.state.note(now_ns)

    def ingest(self, received: Iterable[Received], now_ns: int) -> None:
        """Remember messages that came at a time."""
        received = list(received)
        self.state.ingest(received)
        for item in received:
            self._hear(item.message, now_ns)

    def begin_anew(self) -> None:
        """Forget the past: a replay has jumped to another time. `show_anew` updates the viewers."""
        for subscription in (self._newest, self._less_often, self._each, self._images):
            subscription.drain_samples()
        self.state = ConsoleState(self._cast, self._now_ns(), self._cameras)
        self._pictures = PictureDesk(self._lenses)
        self.sessions.desk = CommandDesk(self._bus, tuple(self._cast.drones))

    def show_anew(self, now_ns: int) -> None:
        """Send everything to all viewers, as to a new one."""
        self._take_pictures(now_ns)
        self.board.begin()
        self.board.forget()
        self.state.history.take_new()  # the seed holds it
        self.state.put(self.board, now_ns)
        self.state.put_often(self.board, now_ns)
        self.state.put_seldom(self.board, now_ns)
        self._put_own(now_ns)
        for viewer in self.sessions.viewers.values():
            viewer.reseed()
            for camera, frame in self._pictures.frames.items():
                viewer.show(camera, frame)

    def _put_own(self, now_ns: int) -> None:
        self.board.put("detections", self._pictures.detections())
        self.board.put("refused_pictures", self._pictures.refused)
        self.board.put("orders", self.sessions.desk.summary())
        self.board.put("session", self.sessions.summary(now_ns))
        if self._end is not None:
            words, at_ms = self._end.text, self._end.header.stamp_ns / 1e6
            ended = {"text": words, "severity": self._end.severity, "at": at_ms, "closed": self.closed}
            down = None if words.endswith(SOME_UNHEARD) else words.endswith(ALL_DOWN)
            self.board.put("ended", ended | {"down": down})
        if self._result is not None:
            self.board.put("result", self._result.section())
        if self._player is not None:
            self.board.put("playback", self._player.section())

    def _hear(self, message: object, now_ns: int) -> None:
        match message:
            case Command():
                self.sessions.desk.take(message, now_ns)
                self.sessions.take(message)
            case CommandAck():
                self.sessions.desk.take(message, now_ns)
            case Lease():
                self.sessions.desk.hear_lease(message)
            case RelativeObservation():
                self._pictures.take_detection(message)
            case Event(ends_run=True) if self._player is None:
                self._end = message
            case _:
                pass

    def _take_pictures(self, now_ns: int) -> None:
        for received in self._images.drain():
            camera = received.header.entity
            if self._pictures.take_picture(camera, received.header, received.payload, now_ns):
                for viewer in self.sessions.viewers.values():
                    viewer.show(camera, self._pictures.frames[camera])

    def _seed(self, seq: int) -> str:
        seed = {
            "type": "seed",
            "run": self._run,
            "seq": seq,
            "now": self._now_ns() / 1e6,
            "scene": self._scene,
            "history": self.state.history.as_json(),
            "s": msgspec.Raw(self.board.since(-1)),
        }
        return msgspec.json.encode(seed).decode()
