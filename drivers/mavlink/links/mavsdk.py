"""Links through MAVSDK 4, a native library that discovers the vehicles and carries messages.

The port itself stays ours (`raw://`): traffic in both directions is recorded to the byte, refusals have the same names
as on the other links, and each vehicle has a Mavsdk object of its own. With one object for all, messages that name no
target (poses, clock answers) would go to every vehicle on the port.

Messages go through `mavlink_direct`, whose JSON is made from tuples with all fields: a missing one would be sent as 0.
Its offboard plugin, which repeats the last setpoint by itself, is not used; nor is its clock synchronisation, because
the poses that we feed are stamped by our own boot clock. It sends a heartbeat each second in addition to ours.
"""

import json
import logging
import math
import queue
import threading
import time
from collections import deque
from typing import Any

from mavsdk import Configuration, ConnectionResult, Mavsdk
from mavsdk.exceptions import MavsdkError
from mavsdk.logging import log_subscribe
from mavsdk.plugins.mavlink_direct import MavlinkDirect
from mavsdk.plugins.mavlink_direct.mavlink_direct import MavlinkMessage

from drivers.mavlink.links.seam import Heard, Transport
from drivers.mavlink.settings import LinkSettings
from drivers.mavlink.wire.errors import WireError
from drivers.mavlink.wire.frames import CLASSES, Message, ReceivedFrame, fields_of, name_of
from drivers.mavlink.wire.names import AUTOPILOT_COMPONENT
from drivers.mavlink.wire.telemetry import Heartbeat
from groundstation.adapters import Address
from groundstation.errors import DriverError

_POLL_S = 0.1
_WAITING = 4096
_MOST_SYSTEMS = 64
_MEET_TRIES, _MEET_S = 40, 0.005
_log = logging.getLogger(__name__)


def message_from_json(name: str, text: str) -> Message | None:
    """Return a message from MAVSDK's JSON, None for kinds that are not used; raises WireError."""
    cls = CLASSES.get(name)
    if cls is None:
        return None
    try:
        fields = json.loads(text)
        values = {key: _value(fields[key]) for key in fields_of(cls) if key in fields}
        return cls(**values)
    except (ValueError, TypeError, KeyError) as error:
        raise WireError("malformed", f"{name}: {error}") from error


def _value(value: Any) -> Any:
    if isinstance(value, list):
        return tuple(map(_value, value))
    return math.nan if value is None else value


def json_from_message(message: Message) -> str:
    """Return all fields of a message as JSON; raises WireError for values that MAVSDK refuses (not finite)."""
    try:
        return json.dumps(dict(zip(fields_of(type(message)), message, strict=True)), allow_nan=False)
    except ValueError as error:
        raise WireError("unencodable", f"{name_of(message)}: {error}") from error


class _System:
    """One vehicle and its Mavsdk object."""

    def __init__(self, number: int, settings: LinkSettings, transport: Transport, heard: "queue.Queue[Heard]") -> None:
        self.number, self._transport, self._heard = number, transport, heard
        self._passed: deque[Heard] = deque(maxlen=256)
        self._direct: MavlinkDirect | None = None
        self._mavsdk = Mavsdk(Configuration.create_manual(settings.system_id, settings.component_id, True))
        if (result := self._mavsdk.add_any_connection("raw://")) != ConnectionResult.SUCCESS:
            self._mavsdk.destroy()
            raise DriverError(f"MAVSDK does not take frames: {result.name.lower().replace('_', ' ')}")
        self._mavsdk.subscribe_raw_bytes_to_be_sent(lambda data: transport.send_raw(number, data))

    def take(self, heard: Heard, raw: bytes) -> None:
        """Hand a frame of the vehicle to the library."""
        if self._direct is None:
            self._meet(raw)
        if self._direct is not None:
            self._passed.append(heard)
            self._mavsdk.pass_received_raw_bytes(raw)

    def _meet(self, raw: bytes) -> None:
        # The library discovers vehicles on a thread of its own, and a plugin made in its callback would wait for
        # itself; the heartbeat that introduced the vehicle is passed on again once there is a listener.
        self._mavsdk.pass_received_raw_bytes(raw)
        for _ in range(_MEET_TRIES):
            if self._mavsdk.system_count():
                self._direct = MavlinkDirect(self._mavsdk.get_systems()[0])
                self._direct.subscribe_message("", self._decode)
                return
            time.sleep(_MEET_S)

    def _decode(self, message: MavlinkMessage, _: Any) -> None:
        # On a thread of the library: only decode and enqueue.
        try:
            decoded = message_from_json(message.message_name, message.fields_json)
        except WireError as error:
            self._transport.rejected[error.reason] += 1
            return
        passed = self._passed_as(decoded)
        if passed is None:
            self._transport.rejected["unexpected"] += 1
            return
        frame = ReceivedFrame(self.number, int(message.component_id), passed.frame.sequence, decoded)
        try:
            self._heard.put_nowait(Heard(passed.stamp_ns, frame))
        except queue.Full:
            self._transport.rejected["overflow"] += 1

    def _passed_as(self, decoded: Message | None) -> Heard | None:
        # Arrival and number of each frame: the library keeps the order, but not every kind.
        while self._passed:
            passed = self._passed.popleft()
            if type(passed.frame.message) is type(decoded):
                return passed
        return None

    def send(self, message: Message) -> None:
        """Send a message; the library adds its own heartbeats, one a second, which alone would be too few."""
        if self._direct is None:
            return
        carrier = MavlinkMessage(name_of(message), 0, 0, self.number, AUTOPILOT_COMPONENT, json_from_message(message))
        try:
            self._direct.send_message(carrier)
        except MavsdkError as error:
            self._transport.rejected["send_failed"] += 1
            _log.debug("%s: %s", carrier.message_name, error)

    def close(self) -> None:
        """Leave the library."""
        if self._direct is not None:
            self._direct.destroy()
        self._mavsdk.destroy()


class MavsdkLink:
    """One port, a thread that passes its datagrams to the library, and the vehicles behind it."""

    def __init__(self, settings: LinkSettings, transport: Transport) -> None:
        self.rejected = transport.rejected
        self._settings, self._transport = settings, transport
        self._heard: queue.Queue[Heard] = queue.Queue(_WAITING)
        self._systems: dict[int, _System] = {}
        self._closing = threading.Event()
        log_subscribe(_to_log)
        self._pump = threading.Thread(target=self._run, name="mavsdk port", daemon=True)
        self._pump.start()

    def _run(self) -> None:
        while not self._closing.is_set():
            try:
                for heard, raw in self._transport.receive_raw():
                    system = self._systems.get(heard.frame.system) or self._met(heard)
                    if system is not None and not self._closing.is_set():
                        system.take(heard, raw)
            except Exception:  # noqa: BLE001 - the port must be read whatever the library says: count, log, go on
                self.rejected["internal"] += 1
                _log.exception("a frame could not be handed to MAVSDK")

    def _met(self, heard: Heard) -> _System | None:
        number = heard.frame.system
        if not isinstance(heard.frame.message, Heartbeat):
            return None
        if len(self._systems) >= _MOST_SYSTEMS:
            self.rejected["too_many_systems"] += 1
            return None
        system = self._systems[number] = _System(number, self._settings, self._transport, self._heard)
        return system

    @property
    def called_from(self) -> tuple[Address, ...]:
        """Return the last addresses of the vehicles, if the link waits for them."""
        return self._transport.called_from

    @property
    def newest_stamp(self) -> int:
        """Return the newest time of signing of the transport."""
        return self._transport.newest_stamp

    def receive(self) -> list[Heard]:
        """Wait up to 0.1 s; return the messages received."""
        try:
            heard = [self._heard.get(timeout=_POLL_S)]
            while not self._heard.empty():
                heard.append(self._heard.get_nowait())
        except queue.Empty:
            return []
        return heard

    def send(self, system: int, message: Message) -> None:
        """Send to a vehicle; before its first message only a greeting, if the link has to send first."""
        if self._closing.is_set():
            return
        known = self._systems.get(system)
        if known is not None:
            known.send(message)
        elif isinstance(message, Heartbeat):
            self._transport.send(system, message)

    def close(self) -> None:
        """Leave the library and close the port."""
        self._closing.set()
        self._pump.join(timeout=1.0)
        for system in self._systems.values():
            system.close()
        self._transport.close()


def _to_log(level: int, text: str, file: str | None, line: int) -> bool:
    _log.debug("mavsdk %s", text)
    return True
