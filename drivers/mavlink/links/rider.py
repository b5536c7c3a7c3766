"""A second ground station of one vehicle (rider): its port, and its remaining allowance."""

import socket
from contextlib import suppress
from dataclasses import dataclass

from drivers.mavlink.requests import word_of
from drivers.mavlink.riding_along import made_good, words_of
from drivers.mavlink.settings import VehicleSettings
from drivers.mavlink.stop_queue import StopQueue
from drivers.mavlink.wire.file_transfer import refusal
from drivers.mavlink.wire.flight import CommandAckMessage, CommandInt, CommandLong
from drivers.mavlink.wire.frames import FrameDecoder, FrameEncoder, Message, ReceivedFrame
from drivers.mavlink.wire.names import AUTOPILOT_COMPONENT, Flavour, MavResult
from drivers.mavlink.wire.service import FileTransferProtocol
from drivers.mavlink.wire.verification import check_signature
from groundstation.time_units import NS_PER_S

# Frames that pass in addition to stops: enough for a table of parameters in half a minute, too few to delay setpoints.
_FRAMES_PER_S = 50
_ANSWERED_NS = 3 * NS_PER_S
_UNDERWAY = (MavResult.ACCEPTED, MavResult.IN_PROGRESS)


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
    """The way to and from the second ground station of one vehicle, on a port of its own.

    key: that of a signed link, else empty: without it the vehicle would ignore what the station sends.
    """

    def __init__(self, vehicle: VehicleSettings, key: bytes = b"") -> None:
        _, host, port = vehicle.forward.split(":")
        self.name, self.system = vehicle.name, vehicle.system_id
        self.flavour = Flavour[vehicle.flavour.upper()]
        self.allowed, self.target = vehicle.forward_allows, (host, int(port))
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.setblocking(False)
        self.decoder, self.encoder = FrameDecoder(), FrameEncoder(vehicle.system_id, AUTOPILOT_COMPONENT)
        self._key = key
        self.allowance, self.stops = _Allowance(), StopQueue()
        self._asked: dict[int, tuple[int, str]] = {}

    def show(self, data: bytes) -> None:
        """Send frames to the second ground station; an absent one costs nothing."""
        with suppress(OSError):
            self.socket.sendto(data, self.target)

    def refuse(self, frame: ReceivedFrame) -> None:
        """Answer like a vehicle that refuses the request; a point of a mission gets no answer."""
        match frame.message:
            case CommandLong(command=command) | CommandInt(command=command):
                answer: Message = CommandAckMessage(command, MavResult.DENIED, 0, 0, frame.system, frame.component)
            case FileTransferProtocol() as request:
                answer = refusal(request, frame.system, frame.component)
            case _:
                return
        self.show(self.encoder.encode(answer))

    def check_signature(self, raw: bytes) -> None:
        """Return if the vehicle takes the signature of a frame, or needs none; raises WireError (unsigned, signature).

        The vehicle judges the time of signing, since it alone knows which senders it has heard.
        """
        if self._key:
            check_signature(raw, self._key)

    def stop(self, now_ns: int, message: Message, raw: bytes) -> str:
        """Put a stop into the queue, and return it in words."""
        words, command = words_of(message, self.flavour), getattr(message, "command", None)
        self.stops.put((type(message), command, words), raw)
        if command is not None:
            self._asked[command] = now_ns + _ANSWERED_NS, words
        if (more := made_good(message, self.system, self.flavour)) is not None:
            self.stops.put(more, more)
        return words

    def refused_stop(self, now_ns: int, answer: CommandAckMessage) -> str:
        """Return the stop that the vehicle refuses by an answer, with the reason; "" for none."""
        until_ns, words = self._asked.get(answer.command, (0, ""))
        if now_ns > until_ns or answer.result in _UNDERWAY:
            return ""
        return f"{words}: {word_of(answer.result)}"
