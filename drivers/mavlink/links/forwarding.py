"""Forwards a link to a second ground station (QGroundControl, MAVProxy), which may send queries and stops."""

import logging
import select
import threading
from collections.abc import Callable, Iterable, Mapping

from drivers.mavlink.links.refusals import LinkRefusals
from drivers.mavlink.links.rider import Rider
from drivers.mavlink.links.seam import Heard, Transport
from drivers.mavlink.riding_along import Passage, may_pass, passage_of, words_of
from drivers.mavlink.settings import VehicleSettings
from drivers.mavlink.wire.errors import WireError
from drivers.mavlink.wire.flight import CommandAckMessage
from drivers.mavlink.wire.frames import MAX_DATAGRAM, Message, ReceivedFrame, split
from drivers.mavlink.wire.verification import number_of
from groundstation.adapters import Address
from groundstation.bus import clock
from groundstation.time_units import NS_PER_S

_POLL_NS = NS_PER_S // 5
_log = logging.getLogger(__name__)

_TAKEN_BACK, _MAVLINK_2 = "RESUME or TRACK takes the drone back", "set it to MAVLink 2"
_STOP_HERE = "order HOLD or LAND here"
_KEY = "order HOLD or LAND here, and give that station the link's key"

Tell = Callable[[str, str], None]


def with_riders(
    transport: Transport, vehicles: Mapping[int, VehicleSettings], tell: Tell, key: bytes = b""
) -> Transport:
    """Return the link with its second ground stations (riders), unchanged if there are none.

    tell: texts with remedies. key: that of a signed link.
    """
    riders = {system: Rider(vehicle, key) for system, vehicle in vehicles.items() if vehicle.forward}
    return ForwardedLink(transport, riders, tell) if riders else transport


class ForwardedLink(Transport):
    """Forwards another transport to riders, and receives from them in a thread of its own.

    A rider's frames are judged by `riding_along.passage_of`; refused ones, and those beyond 50 a second, are
    counted in `rejected` ("rider_..."). Every stop passes unless an equal one follows within 20 ms; of repetitions
    within a second only the first is reported.
    """

    def __init__(self, transport: Transport, riders: Mapping[int, Rider], tell: Tell) -> None:
        self._transport, self._riders, self._tell = transport, riders, tell
        self._told_ns: dict[str, int] = {}
        self._closing = threading.Event()
        self._listener = threading.Thread(target=self._listen, name="mavlink-riders", daemon=True)
        self._listener.start()

    @property
    def rejected(self) -> LinkRefusals:
        """Return the transport's counts together with ours."""
        return self._transport.rejected

    @rejected.setter
    def rejected(self, counts: LinkRefusals) -> None:
        self._transport.rejected = counts

    @property
    def called_from(self) -> tuple[Address, ...]:
        """Return the addresses from which the vehicles call."""
        return self._transport.called_from

    @property
    def newest_stamp(self) -> int:
        """Return the newest time of signing of the transport."""
        return self._transport.newest_stamp

    def receive_raw(self) -> list[tuple[Heard, bytes]]:
        """Wait up to 0.1 s; return the arrived data, and forward it to the vehicle's rider."""
        found = self._transport.receive_raw()
        for heard, raw in found:
            rider = self._riders.get(heard.frame.system)
            if rider is not None:
                rider.show(raw)
                if isinstance(heard.frame.message, CommandAckMessage):
                    self._note_refusal(rider, heard.stamp_ns, heard.frame.message)
        return found

    def _note_refusal(self, rider: Rider, now_ns: int, answer: CommandAckMessage) -> None:
        if why := rider.refused_stop(now_ns, answer):
            self._tell_once(f"{rider.name} refuses the stop of a second ground station ({why})", _STOP_HERE)

    def send(self, system: int, message: Message) -> None:
        """Send to one vehicle."""
        self._transport.send(system, message)

    def send_raw(self, system: int, data: bytes) -> None:
        """Send whole frames to one vehicle."""
        self._transport.send_raw(system, data)

    def close(self) -> None:
        """End the listener and close all ports."""
        self._closing.set()
        self._listener.join(timeout=1.0)
        for rider in self._riders.values():
            rider.socket.close()
        self._transport.close()

    def _listen(self) -> None:
        by_socket = {rider.socket: rider for rider in self._riders.values()}
        while not self._closing.is_set():
            try:
                ready, _, _ = select.select(list(by_socket), [], [], self._patience_s(by_socket.values()))
                for one in ready:
                    self._take(by_socket[one])
                for rider in by_socket.values():
                    self._pass_stop(rider)
            except Exception:  # noqa: BLE001 - a rider's garbage must not end the way of its stops
                if self._closing.is_set():
                    return
                self.rejected["rider_internal"] += 1
                _log.exception("a frame of a second ground station could not be used")

    @staticmethod
    def _patience_s(riders: Iterable[Rider]) -> float:
        now_ns = clock.now_ns()
        waits = (rider.stops.wait_ns(now_ns) for rider in riders)
        return min((wait_ns for wait_ns in waits if wait_ns is not None), default=_POLL_NS) / NS_PER_S

    def _pass_stop(self, rider: Rider) -> None:
        match rider.stops.take(clock.now_ns()):
            case None:
                pass
            case bytes() as raw:
                self._transport.send_raw(rider.system, raw)
            case message:
                self._transport.send(rider.system, message)

    def _take(self, rider: Rider) -> None:
        try:
            data, source = rider.socket.recvfrom(MAX_DATAGRAM)
        except OSError:  # nobody is there: the error answers a forwarded datagram
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
            return  # as most are: its own position, heartbeats, echoes of received frames
        try:
            self._judge(rider, raw, rider.decoder.decode(raw))
        except WireError as error:  # a stop may follow it
            self._reject(rider, error)

    def _reject(self, rider: Rider, error: WireError) -> None:
        self.rejected[f"rider_{error.reason}"] += 1
        if error.reason == "mavlink_1":
            self._tell_once(
                f"{rider.name}: a second ground station speaks MAVLink 1: its stops do not pass", _MAVLINK_2
            )

    def _judge(self, rider: Rider, raw: bytes, frame: ReceivedFrame) -> None:
        message = frame.message
        match passage_of(number_of(raw), message, rider.system, rider.flavour, rider.allowed, raw):
            case Passage.STOP if message is not None:
                if not self._is_signed(rider, raw, words_of(message, rider.flavour)):
                    return
                words = rider.stop(clock.now_ns(), message, raw)
                self._pass_stop(rider)
                self._tell_once(f"{rider.name}: a second ground station stops it ({words})", _TAKEN_BACK)
            case Passage.PASS if rider.allowance.take(clock.now_ns()):
                rider.check_signature(raw)
                self._transport.send_raw(rider.system, raw)
            case Passage.PASS:
                self.rejected["rider_too_many"] += 1
            case Passage.REFUSE:
                self.rejected["rider_refused"] += 1
                rider.refuse(frame)

    def _is_signed(self, rider: Rider, raw: bytes, words: str) -> bool:
        """Return whether the vehicle takes a stop's signature; if not, it is reported as one that does not pass."""
        try:
            rider.check_signature(raw)
        except WireError as error:
            self._reject(rider, error)
            why = "is not signed" if error.reason == "unsigned" else "is signed with another key"
            text = f"{rider.name}: a second ground station's stop ({words}) {why} and does not pass"
            self._tell_once(text, _KEY)
            return False
        return True

    def _tell_once(self, text: str, remedy: str) -> None:
        now_ns = clock.now_ns()
        last_ns, self._told_ns[text] = self._told_ns.get(text), now_ns
        if last_ns is None or now_ns - last_ns > NS_PER_S:
            self._tell(text, remedy)
