"""Frames of a motion capture system: NatNet by our own client, other systems by the library `motioncapture`."""

import importlib
import select
import socket
import threading
from collections import Counter, deque
from contextlib import ExitStack, suppress
from pkgutil import resolve_name
from typing import Any, Protocol

from drivers.host_lookup import HostLookup
from drivers.motion_capture.captured_frame import CapturedFrame
from drivers.motion_capture.plug_in_source import PlugInSource
from drivers.motion_capture.pose_guard import LATE_S
from drivers.motion_capture.settings import OURS, SystemAddress
from drivers.motion_capture.wire import natnet
from drivers.plausibility.clock_watch import ClockWatch
from groundstation import plug_ins
from groundstation.bus import clock
from groundstation.errors import DriverError, SettingsError
from groundstation.time_units import NS_PER_S

_SILENT_NS = _LOOK_UP_AGAIN_NS = NS_PER_S
# Names are asked for while frames wait for them; anew in case that word of their change was lost.
_ASK_AGAIN_NS, _CONFIRM_NS = NS_PER_S // 5, 3 * NS_PER_S
_UNNAMED = "its bodies have no names yet"
_AGAIN_S = 1.0
_ANSWERS_WITHIN_S = 2.0
_LOST_NS = 5 * NS_PER_S
_KEEP_ALIVE_NS = NS_PER_S
_LARGEST = 65535
_DATAGRAMS = 64
_WAITING_FRAMES = 64


_USED = ("rejected", "detail", "poll", "close")


class Source(Protocol):
    """A source of frames; rejected: refusals by reason; detail: present fault, in words."""

    rejected: Counter[str]
    detail: str

    def poll(self, wait_s: float) -> list[CapturedFrame]:
        """Return the arrived frames, the oldest first; waits up to wait_s for the first."""

    def close(self) -> None:
        """Release everything."""


def open_source(address: SystemAddress) -> Source:
    """Return the source of a system.

    Raises SettingsError if its library is missing, DriverError for a plug-in that cannot be loaded.
    """
    if address.scheme in OURS:
        ours: Source = resolve_name(OURS[address.scheme].reader)(address)
        return ours
    try:
        source = plug_ins.made(plug_ins.WORLD_SENSORS, address.scheme, _USED, address)
    except plug_ins.PlugInError as error:
        raise DriverError(f"motion capture source {address.scheme}://: {error}") from None
    return PlugInSource(address.scheme, source)


class NatnetSource:
    """A NatNet client: one socket for requests and frames to it alone, one for frames to a group or the data port."""

    def __init__(self, address: SystemAddress) -> None:
        self.rejected: Counter[str] = Counter()
        self.detail = self._no_answer = f"no answer from {address.host}:{address.port}"
        self._host, self._port, self._failed = HostLookup(address.host), address.port, ""
        self._requests = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._requests.setblocking(False)
        self._frames: socket.socket | None = None
        self._server: natnet.Server | None = None
        self._names: dict[int, str] = {}
        self._named = False  # else names are missing, or may belong to other bodies by now: no frame is used
        self._lacks_name, self._changed, self._clock = False, False, ClockWatch()
        self._last = (-1, 0)  # number and ticks of the last frame
        self._looked_up_ns = self._asked_ns = self._alive_ns = self._framed_ns = 0

    def poll(self, wait_s: float) -> list[CapturedFrame]:
        """Return the arrived frames, the oldest first; requests what is missing."""
        now_ns = clock.now_ns()
        self._find_host(now_ns)
        if self._host.found:
            self._ask(now_ns)
        sockets = [one for one in (self._requests, self._frames) if one is not None]
        readable, _, _ = select.select(sockets, [], [], wait_s)
        return [frame for one in readable for frame in self._read(one)]

    def close(self) -> None:
        """Close the sockets."""
        self._requests.close()
        self._leave()

    def _find_host(self, now_ns: int) -> None:
        # A silent system may have another address by now.
        if now_ns - max(self._framed_ns, self._looked_up_ns) >= _LOOK_UP_AGAIN_NS:
            self._looked_up_ns = now_ns
            self._host.look_up()
        if self._host.failed != self._failed:
            self._failed = self._host.failed
            self.detail = self._failed or self._no_answer

    def _ask(self, now_ns: int) -> None:
        # A restarted system has no clients: it streams only to those that request it.
        if self._is_silent(now_ns) or self._lacks_name:
            again_ns = _SILENT_NS
        else:
            again_ns = _CONFIRM_NS if self._named else _ASK_AGAIN_NS
        if now_ns - self._asked_ns >= again_ns:
            self._asked_ns = now_ns
            self._send(natnet.connect_request())
            self._send(natnet.encode(natnet.REQUEST_DESCRIPTIONS))
        if now_ns - self._alive_ns >= _KEEP_ALIVE_NS:
            self._alive_ns = now_ns
            self._send(natnet.encode(natnet.KEEP_ALIVE))

    def _is_silent(self, now_ns: int) -> bool:
        return now_ns - self._framed_ns >= _SILENT_NS

    def _send(self, datagram: bytes) -> None:
        with suppress(OSError):  # a network that is down now may be up later
            self._requests.sendto(datagram, (self._host.found[0], self._port))

    def _read(self, one: socket.socket) -> list[CapturedFrame]:
        frames = []
        for _ in range(_DATAGRAMS):
            try:
                datagram, sender = one.recvfrom(_LARGEST)
            except OSError:
                break
            if sender[0] not in self._host.found:
                self.rejected["stranger"] += 1
                continue
            try:
                frame = self._take(datagram)
            except natnet.WireError as error:
                self.rejected[error.reason] += 1
                self.detail = error.told or self.detail
                continue
            if frame is not None:
                frames.append(frame)
        return frames

    def _take(self, datagram: bytes) -> CapturedFrame | None:
        kind, payload = natnet.message_of(datagram)
        if kind == natnet.SERVER_INFO:
            self._greet(natnet.decode_server(payload))
        elif kind == natnet.DESCRIPTIONS and self._server is not None:
            self._names = natnet.decode_descriptions(payload, self._server.version)
            self._named, self._lacks_name = bool(self._names), False
        elif kind == natnet.FRAME and self._server is not None:
            return self._captured(natnet.decode_frame(payload, self._server.version), self._server)
        return None

    def _greet(self, server: natnet.Server) -> None:
        before, self._server, self.detail = self._server, server, ""
        moved = before is None or (before.group, before.data_port) != (server.group, server.data_port)
        silent = self._is_silent(clock.now_ns())
        # A system that was restarted may send elsewhere; an adapter that was unplugged has left the group.
        if moved or silent:
            self._leave()
        # WIRE (docs/reference/natnet.md 1): frames to one client may come to the port that asked or to the data port.
        # Other programs of this host may want the latter: it is opened only while nothing comes to the former.
        if self._frames is None and (server.group or (silent and not moved)):
            try:
                self._frames = self._opened(server.group, server.data_port)
            except OSError as error:  # a port taken by another program, or an invalid address: tried again
                place = f"{server.group or 'port'}:{server.data_port}"
                self.detail = f"its frames cannot be taken at {place}: {error.strerror or error}"

    def _leave(self) -> None:
        if self._frames is not None:
            self._frames.close()
        self._frames = None

    def _opened(self, group: str, port: int) -> socket.socket:
        with ExitStack() as unless_opened:
            frames = unless_opened.enter_context(socket.socket(socket.AF_INET, socket.SOCK_DGRAM))
            frames.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            frames.setblocking(False)
            frames.bind(("", port))
            if group:
                self._join(frames, group)
            unless_opened.pop_all()
        return frames

    def _join(self, frames: socket.socket, group: str) -> None:
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as route:
            route.connect((self._host.found[0], self._port))  # the interface that leads to the system
            local = route.getsockname()[0]
        membership = socket.inet_aton(group) + socket.inet_aton(local)
        frames.setsockopt(socket.IPPROTO_IP, socket.IP_ADD_MEMBERSHIP, membership)

    def _captured(self, frame: natnet.Frame, server: natnet.Server) -> CapturedFrame | None:
        now_ns, came_by_the_other_port = clock.now_ns(), frame.sent and (frame.number, frame.sent) == self._last
        self._last = frame.number, frame.sent
        if came_by_the_other_port:
            return None
        # A restarted system may name its bodies differently; how long one keeps the mark of a change is unknown.
        if (frame.changed and not self._changed) or self._is_silent(now_ns):
            self._named = False
        self._framed_ns, self._changed = now_ns, frame.changed
        late_s = self._late_s(now_ns, frame, server)
        if late_s > LATE_S:
            self.rejected["late"] += 1
            self.detail = f"its frames come {late_s:.1f} s late"
            return None
        if not self._named:
            self.detail = _UNNAMED
            return None
        self.detail = ""
        self._lacks_name = any(body.id not in self._names for body in frame.bodies)
        ticks = frame.sent - frame.exposed
        processing_ns = ticks * NS_PER_S // server.ticks_per_s if frame.exposed and server.ticks_per_s else 0
        named = {self._names.get(body.id, str(body.id)): body for body in frame.bodies}
        return CapturedFrame(
            now_ns,
            max(0, processing_ns) + round(late_s * NS_PER_S),
            {name: (body.position, body.rotation) for name, body in named.items() if body.tracked},
            tuple(name for name, body in named.items() if not body.tracked),
        )

    def _late_s(self, now_ns: int, frame: natnet.Frame, server: natnet.Server) -> float:
        """Return by how much later than the freshest frames one came, by the system's clock [s]."""
        if not frame.sent or not server.ticks_per_s:
            return 0.0
        return self._clock.update(now_ns, frame.sent * NS_PER_S // server.ticks_per_s)[1]


class LibrarySource:
    """A system behind the library `motioncapture` (extra `mocap`), read in a thread: its calls block.

    A call that waits for a lost Vicon or Qualisys system never ends: `poll` raises DriverError, so that a new process
    connects anew.
    """

    def __init__(self, address: SystemAddress) -> None:
        self.rejected: Counter[str] = Counter()
        self.detail = f"no answer from {address.host}"
        try:
            library: Any = importlib.import_module("motioncapture")
        except ImportError:
            remedy = "install it: pip install 'skein-groundstation[mocap]'"
            raise SettingsError([f"{address.scheme}://: the library motioncapture is missing; {remedy}"]) from None
        self._library, self._address, self._framed_ns = library, address, 0
        # Of VRPN the library returns by a timer what came, also without a server: nothing is no frame.
        self._whole = address.scheme != "vrpn"
        self._frames: deque[CapturedFrame] = deque(maxlen=_WAITING_FRAMES)
        self._came, self._closing = threading.Event(), threading.Event()
        threading.Thread(target=self._follow, name="motion capture", daemon=True).start()

    def poll(self, wait_s: float) -> list[CapturedFrame]:
        """Return the frames that came, the oldest first."""
        self._came.wait(wait_s)
        self._came.clear()
        frames = []
        while self._frames:
            frames.append(self._frames.popleft())
        framed_ns = self._framed_ns
        if self._whole and framed_ns and clock.now_ns() - framed_ns > _LOST_NS:
            raise DriverError(f"no frame from {self._address.host} for {_LOST_NS / NS_PER_S:g} s: connecting anew")
        return frames

    def close(self) -> None:
        """Let the thread end after its next frame; the process ends without it."""
        self._closing.set()

    def _follow(self) -> None:
        while not self._closing.is_set():
            self._framed_ns = 0
            try:
                if self._answers():
                    self._read_frames()
            except Exception as error:  # noqa: BLE001 - what a foreign library raises is shown, and tried again
                self.detail = f"{type(error).__name__}: {error}"
            self._closing.wait(_AGAIN_S)

    def _answers(self) -> bool:
        offset = OURS[self._address.scheme].answers_at
        if offset is None:
            return True
        place = (self._address.host, self._address.port + offset)
        try:
            socket.create_connection(place, _ANSWERS_WITHIN_S).close()
        except OSError:
            self.detail = f"no answer from {place[0]}:{place[1]}"
            return False
        return True

    def _read_frames(self) -> None:
        system = self._library.connect(self._address.scheme, _place(self._address))
        while not self._closing.is_set():
            system.waitForNextFrame()
            frame = _frame_of(system.rigidBodies, self._whole)
            if frame.poses or self._whole:
                self._framed_ns = frame.arrival_ns
                self._frames.append(frame)
                self.detail = ""
                self._came.set()


def _place(address: SystemAddress) -> dict[str, str]:
    port = {"port": str(address.port)} if OURS[address.scheme].any_port else {}
    return {"hostname": address.host} | port


def _frame_of(bodies: Any, whole: bool) -> CapturedFrame:
    poses = {}
    for name, body in bodies.items():
        x, y, z = (float(value) for value in body.position)
        turn = body.rotation
        poses[str(name)] = ((x, y, z), (float(turn.x), float(turn.y), float(turn.z), float(turn.w)))
    return CapturedFrame(clock.now_ns(), 0, poses, whole=whole)
