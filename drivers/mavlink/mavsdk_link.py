"""The same seam over MAVSDK 4 (a native library): it finds vehicles and carries messages; what is said stays ours.

Messages go through `mavlink_direct`, whose JSON is made from tuples with all fields: a missing one would be sent as 0.
Its offboard plugin, which repeats the last set-point by itself, is not used; nor is its clock synchronisation, because
the poses that we feed are stamped on our own boot clock. It keeps the ground station's heartbeat alive by itself.
"""

import json
import logging
import math
import queue
import socket
from collections import Counter
from typing import Any

from mavsdk import Configuration, ConnectionResult, Mavsdk
from mavsdk.exceptions import MavsdkError
from mavsdk.logging import log_subscribe
from mavsdk.plugins.mavlink_direct import MavlinkDirect
from mavsdk.plugins.mavlink_direct.mavlink_direct import MavlinkMessage

from drivers.mavlink.link import Heard
from drivers.mavlink.settings import LinkSettings
from drivers.mavlink.wire.errors import WireError
from drivers.mavlink.wire.frames import CLASSES, Frame, Message, name_of
from drivers.mavlink.wire.telemetry import Heartbeat
from groundstation.bus import clock
from groundstation.errors import DriverError

_POLL_S = 0.1
_WAITING = 4096
_log = logging.getLogger(__name__)


def message_from_json(name: str, text: str) -> Message | None:
    """Return a message from MAVSDK's JSON, None for kinds that are not used; raises WireError."""
    cls = CLASSES.get(name)
    if cls is None:
        return None
    try:
        fields = json.loads(text)
        values = {key: _value(fields[key]) for key in cls._fields if key in fields}  # type: ignore[attr-defined]
        return cls(**values)
    except (ValueError, TypeError, KeyError) as error:
        raise WireError("malformed", f"{name}: {error}") from error


def _value(value: Any) -> Any:
    if isinstance(value, list):
        return tuple(map(_value, value))
    return math.nan if value is None else value


def json_from_message(message: Message) -> str:
    """Return all fields of a message as JSON; raises WireError for what MAVSDK refuses (not finite)."""
    try:
        return json.dumps(dict(zip(message._fields, message, strict=True)), allow_nan=False)  # type: ignore[attr-defined]
    except ValueError as error:
        raise WireError("unencodable", f"{name_of(message)}: {error}") from error


class MavsdkLink:
    """One Mavsdk object on one connection, with any number of systems."""

    def __init__(self, settings: LinkSettings) -> None:
        self.rejected: Counter[str] = Counter()
        self._heard: queue.Queue[Heard] = queue.Queue(_WAITING)
        self._direct: dict[int, MavlinkDirect] = {}
        self._sequence: Counter[int] = Counter()
        self._closed = False
        _require_free(settings.target)
        log_subscribe(_to_log)
        self._mavsdk = Mavsdk(Configuration.create_manual(settings.system_id, settings.component_id, True))
        result = self._mavsdk.add_any_connection(_url(settings.target))
        if result != ConnectionResult.SUCCESS:
            self._mavsdk.destroy()
            raise DriverError(f"MAVSDK cannot open {settings.target}: {result.name.lower().replace('_', ' ')}")

    def _meet_systems(self) -> None:
        # Polled from the reader: creating a plugin inside a callback of the library would wait for itself.
        if len(self._direct) == self._mavsdk.system_count():
            return
        for system in self._mavsdk.get_systems():
            number = system.get_system_id()
            if number in self._direct:
                continue
            self._direct[number] = direct = MavlinkDirect(system)
            direct.subscribe_message("", self._take)

    def _take(self, message: MavlinkMessage, _: Any) -> None:
        # On a thread of the library: only decode and enqueue.
        now_ns, system = clock.now_ns(), int(message.system_id)
        try:
            decoded = message_from_json(message.message_name, message.fields_json)
        except WireError as error:
            self.rejected[error.reason] += 1
            return
        # The library has dropped what was lost or broken; it does not tell the frames' own numbers.
        self._sequence[system] += 1
        frame = Frame(system, int(message.component_id), self._sequence[system] % 256, decoded)
        try:
            self._heard.put_nowait(Heard(now_ns, frame))
        except queue.Full:
            self.rejected["overflow"] += 1

    def receive(self) -> list[Heard]:
        """Wait up to 0.1 s; return what came."""
        self._meet_systems()
        try:
            heard = [self._heard.get(timeout=_POLL_S)]
            while not self._heard.empty():
                heard.append(self._heard.get_nowait())
        except queue.Empty:
            return []
        return heard

    def send(self, system: int, message: Message) -> None:
        """Send to a system that was found; heartbeats are the library's own business."""
        direct = self._direct.get(system)
        if direct is None or isinstance(message, Heartbeat) or self._closed:
            return
        carrier = MavlinkMessage(name_of(message), 0, 0, system, 1, json_from_message(message))
        try:
            direct.send_message(carrier)
        except MavsdkError as error:
            self.rejected["send_failed"] += 1
            _log.debug("%s: %s", carrier.message_name, error)

    def close(self) -> None:
        """Leave the connection."""
        self._closed = True
        for direct in self._direct.values():
            direct.destroy()
        self._mavsdk.destroy()


def _require_free(target: str) -> None:
    # The library shares a port with whoever has it, and then hears nothing.
    way, address, port = target.split(":")
    if way != "udpin":
        return
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as udp:
        try:
            udp.bind((address, int(port)))
        except OSError as error:
            raise DriverError(f"cannot listen on {target}: is another program using it? ({error})") from error


def _url(target: str) -> str:
    way, address, number = target.split(":")
    return f"{way}://{address}:{number}"


def _to_log(level: int, text: str, file: str | None, line: int) -> bool:
    _log.debug("mavsdk %s", text)
    return True
