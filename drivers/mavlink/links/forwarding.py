"""A link that a second ground station (QGroundControl, MAVProxy) sees as well; it may ask, and stop."""

import logging
import select
import socket
import threading
from collections import Counter
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass

from drivers.mavlink.links.seam import Address, Heard, Transport
from drivers.mavlink.riding_along import Verdict, may_pass, verdict, words_of
from drivers.mavlink.settings import VehicleSettings
from drivers.mavlink.wire.errors import WireError
from drivers.mavlink.wire.flight import CommandAckMessage, CommandInt, CommandLong
from drivers.mavlink.wire.frames import MAX_DATAGRAM, FrameDecoder, FrameEncoder, Message, ReceivedFrame, split
from drivers.mavlink.wire.names import Flavour, MavResult
from drivers.mavlink.wire.verification import number_of
from groundstation.bus import clock
from groundstation.time_units import NS_PER_S

_POLL_S = 0.2
# What passes besides stops: enough for a table of parameters in half a minute, too little to make set-points late.
_FRAMES_PER_S = 50
_AUTOPILOT = 1
_log = logging.getLogger(__name__)

_TAKEN_BACK, _MAVLINK_2 = "RESUME or TRACK takes the drone back", "set it to MAVLink 2"

Tell = Callable[[str, str], None]


def with_riders(transport: Transport, vehicles: Mapping[int, VehicleSettings], tell: Tell) -> Transport:
    """Return the link with those who ride along, or as it is where nobody does; tell: texts with their remedies."""
    riders = {system: Rider(vehicle) for system, vehicle in vehicles.items() if vehicle.forward}
    return ForwardedLink(transport, riders, tell) if riders else transport


@dataclass
class _Allowance:
    """Frames that may still pass in this second."""

    left: int = _FRAMES_PER_S
    until_ns: int = 0

    def take(self, now_ns: int) -> bool:
        if now_ns >= self.until_ns:
            self.left, self.until_ns = _FRAMES_PER_S, now_ns + NS_PER_S
        self.left -= 1
        return self.left >= 0


class Rider:
    """The way to and from the second ground station of one vehicle, on a port of its own."""

    def __init__(self, vehicle: VehicleSettings) -> None:
        _, host, port = vehicle.forward.split(":")
        self.name, self.system = vehicle.name, vehicle.system_id
        self.flavour = Flavour.PX4 if vehicle.flavour == "px4" else Flavour.ARDUPILOT
        self.allowed, self.target = vehicle.forward_allows, (host, int(port))
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.setblocking(False)
        self.decoder, self.encoder = FrameDecoder(), FrameEncoder(vehicle.system_id, _AUTOPILOT)
        self.allowance = _Allowance()

    def show(self, data: bytes) -> None:
        """Send frames to the second ground station; one that is not there costs nothing."""
        with suppress(OSError):
            self.socket.sendto(data, self.target)

    def refuse(self, frame: ReceivedFrame, command: int) -> None:
        """Answer a command as the vehicle would that does not do it."""
        ack = CommandAckMessage(command, MavResult.DENIED, 0, 0, frame.system, frame.component)
        self.show(self.encoder.encode(ack))


class ForwardedLink:
    """Another transport, shown to riders; a thread of its own listens to them.

    A rider's frames are judged by `riding_along.verdict`; what is refused or goes beyond 50 frames a second is counted
    in `rejected` ("rider_..."). All its stops pass; of one that is repeated within a second only the first is told.
    """

    def __init__(self, transport: Transport, riders: Mapping[int, Rider], tell: Tell) -> None:
        self._transport, self._riders, self._tell = transport, riders, tell
        self._told_ns: dict[str, int] = {}
        self._closing = threading.Event()
        self._listener = threading.Thread(target=self._listen, name="mavlink-riders", daemon=True)
        self._listener.start()

    @property
    def rejected(self) -> Counter[str]:
        """Return the transport's counts, with ours in them."""
        return self._transport.rejected

    @rejected.setter
    def rejected(self, counts: Counter[str]) -> None:
        self._transport.rejected = counts

    @property
    def called_from(self) -> tuple[Address, ...]:
        """Return where the vehicles call from."""
        return self._transport.called_from

    def receive(self) -> list[Heard]:
        """Wait up to 0.1 s; return what came."""
        return [heard for heard, _ in self.receive_raw()]

    def receive_raw(self) -> list[tuple[Heard, bytes]]:
        """Wait up to 0.1 s; return what came, and show it to the vehicle's rider."""
        found = self._transport.receive_raw()
        for heard, raw in found:
            rider = self._riders.get(heard.frame.system)
            if rider is not None:
                rider.show(raw)
        return found

    def send(self, system: int, message: Message) -> None:
        """Send to one vehicle."""
        self._transport.send(system, message)

    def send_raw(self, system: int, data: bytes) -> None:
        """Send whole frames to one vehicle."""
        self._transport.send_raw(system, data)

    def close(self) -> None:
        """End the listener and give all ports back."""
        self._closing.set()
        self._listener.join(timeout=1.0)
        for rider in self._riders.values():
            rider.socket.close()
        self._transport.close()

    def _listen(self) -> None:
        by_socket = {rider.socket: rider for rider in self._riders.values()}
        while not self._closing.is_set():
            try:
                ready, _, _ = select.select(list(by_socket), [], [], _POLL_S)
                for one in ready:
                    self._take(by_socket[one])
            except Exception:  # noqa: BLE001 - a rider's garbage must not end the way of its stops
                if self._closing.is_set():
                    return
                self.rejected["rider_internal"] += 1
                _log.exception("a frame of a second ground station could not be used")

    def _take(self, rider: Rider) -> None:
        try:
            data, source = rider.socket.recvfrom(MAX_DATAGRAM)
        except OSError:  # nobody is there: the answer to what was shown
            return
        if source[0] != rider.target[0]:
            self.rejected["rider_address"] += 1
            return
        try:
            for raw in split(data):
                self._take_frame(rider, raw)
        except WireError as error:
            self._reject(rider, error)

    def _take_frame(self, rider: Rider, raw: bytes) -> None:
        if not may_pass(number_of(raw), rider.allowed):
            return  # as most are: its own position, heartbeats, an echo of what it hears
        try:
            self._judge(rider, raw, rider.decoder.decode(raw))
        except WireError as error:  # a stop may come behind it
            self._reject(rider, error)

    def _reject(self, rider: Rider, error: WireError) -> None:
        self.rejected[f"rider_{error.reason}"] += 1
        if error.reason == "mavlink_1":
            self._tell_once(
                f"{rider.name}: a second ground station speaks MAVLink 1: its stops do not pass", _MAVLINK_2
            )

    def _judge(self, rider: Rider, raw: bytes, frame: ReceivedFrame) -> None:
        message = frame.message
        match verdict(number_of(raw), message, rider.system, rider.flavour, rider.allowed):
            case Verdict.STOP:
                self._transport.send_raw(rider.system, raw)
                assert message is not None
                self._tell_once(f"{rider.name}: a second ground station stops it ({words_of(message)})", _TAKEN_BACK)
            case Verdict.PASS if rider.allowance.take(clock.now_ns()):
                self._transport.send_raw(rider.system, raw)
            case Verdict.PASS:
                self.rejected["rider_too_many"] += 1
            case Verdict.REFUSE:
                self.rejected["rider_refused"] += 1
                if isinstance(message, CommandLong | CommandInt):
                    rider.refuse(frame, message.command)
            case Verdict.DROP:
                pass

    def _tell_once(self, text: str, remedy: str) -> None:
        now_ns = clock.now_ns()
        last_ns, self._told_ns[text] = self._told_ns.get(text), now_ns
        if last_ns is None or now_ns - last_ns > NS_PER_S:
            self._tell(text, remedy)
