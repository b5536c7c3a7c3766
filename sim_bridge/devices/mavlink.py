"""A MAVLink vehicle (PX4 or ArduPilot) at the wire: one UDP port of its own loopback address."""

from collections import Counter
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass

from drivers.mavlink.wire import service as s
from drivers.mavlink.wire import telemetry as t
from drivers.mavlink.wire.errors import WireError
from drivers.mavlink.wire.frames import MAX_DATAGRAM, FrameDecoder, FrameEncoder, Message, ReceivedFrame, split
from drivers.mavlink.wire.names import AUTOPILOT_COMPONENT, Flavour
from drivers.mavlink.wire.signature import MAGIC_1
from drivers.mavlink.wire.verification import Signing
from groundstation.time_units import NEVER_NS, NS_PER_S
from sim_bridge.devices.mavlink_ardupilot import ArduCopter
from sim_bridge.devices.mavlink_channel import Channel
from sim_bridge.devices.mavlink_firmware import AutopilotFirmware
from sim_bridge.devices.mavlink_messages import Speaker
from sim_bridge.devices.mavlink_parameters import Parameters
from sim_bridge.devices.mavlink_px4 import Px4
from sim_bridge.devices.mavlink_rates import Rates
from sim_bridge.devices.mavlink_satellites import Satellites
from sim_bridge.devices.mavlink_services import Services
from sim_bridge.devices.mavlink_time import SenderClock
from sim_bridge.listening import open_udp
from sim_bridge.world.mavlink_copter import MavlinkCopter
from sim_bridge.world.world import TICK_NS
from sim_bridge.wrong_values import WrongValues

PORT = 14550
Address = tuple[str, int]
_DATAGRAMS_PER_TICK = 64
_FORGET_NS = 10 * NS_PER_S
_CLIENTS = 8
_TIMESYNC_TICKS = 20
_LIST_PER_TICK = 2
_TEXT_SIZE = 50


@dataclass(frozen=True, slots=True)
class LinkHabits:
    """one_partner: answers only its first sender; old_until_greeted: it calls in MAVLink 1 until MAVLink 2 answers."""

    one_partner: bool = False
    old_until_greeted: bool = False


class MavlinkEmulator:
    """Socket and firmware of one body of the world: `receive`, a step of the world, then `send`, once per tick.

    calls: an address that it sends to unasked; video: its description of its camera. `silent` stops its
    output, `deaf` drops received datagrams, `wrong` changes the reported values (faults), `habits` are those of its
    link. signing: only correctly signed frames count, and all of ours are signed. Times are the world's.
    """

    def __init__(
        self, name: str, address: Address, parameters: Parameters, copter: MavlinkCopter, *,
        calls: Address | None = None, video: t.VideoStreamInformation | None = None, signing: Signing | None = None,
        wrong: WrongValues | None = None,
    ) -> None:  # fmt: skip
        self.name = name
        self.silent = False
        self.deaf = False
        self.rejected: Counter[str] = Counter()
        system, px4 = parameters.system, parameters.flavour is Flavour.PX4
        self._system, self._signing, self._stamp = system, signing, 0
        self.firmware: AutopilotFirmware = (Px4 if px4 else ArduCopter)(copter, parameters)
        self.speaker = Speaker(self.firmware)
        self.services = Services(system, self.firmware, self.speaker, video)
        self._decoder = FrameDecoder(signing)
        self._calls = calls
        self._clients: dict[Address, Channel] = {}
        self._ground_ns: int | None = None
        self._ticks = self._texts = 0
        self._wrong = wrong or None
        self.habits = LinkHabits()
        self.socket = open_udp(f"emulated {name}", *address)

    def equip(self, satellites: Satellites) -> None:
        """Give it a satellite receiver; call it before the first tick."""
        self.firmware.equip(satellites)

    @property
    def now_ns(self) -> int:
        """Return the vehicle's own time since power-on."""
        return self._ticks * TICK_NS

    def fileno(self) -> int:
        """Return the descriptor of its port."""
        return self.socket.fileno()

    def receive(self) -> None:
        """Take all waiting datagrams."""
        for _ in range(_DATAGRAMS_PER_TICK):
            try:
                data, source = self.socket.recvfrom(MAX_DATAGRAM)
            except OSError:
                return
            if not self.deaf:
                self.take(data, source)

    def take(self, data: bytes, source: Address) -> None:
        """Take one datagram; bytes that are no frame, or not signed correctly, are counted."""
        try:
            for raw in split(data, old=True):
                old = raw[0] == MAGIC_1
                try:
                    frame = self._decoder.decode_old(raw) if old else self._decoder.decode(raw)
                except WireError as error:
                    self.rejected[error.reason] += 1
                    continue
                self._take(frame, source, old)
        except WireError as error:
            self.rejected[error.reason] += 1

    def _take(self, frame: ReceivedFrame, source: Address, old: bool) -> None:
        if self.habits.one_partner and (partners := [a for a, c in self._clients.items() if c.heard_ns is not None]):
            source = partners[0]  # it obeys every sender, and answers its partner
        channel = self.channel(source, old)
        news = not channel.is_heard(self.now_ns, _FORGET_NS)
        channel.hear(self.now_ns, old)
        if news:
            channel.listed = None
            self._send_to(source, channel, self.speaker.heartbeat())
        message = frame.message
        if isinstance(message, t.Heartbeat) and self._is_ground(frame.system):
            self._ground_ns = self.now_ns
        for answer in self.services.take(frame, self.now_ns, channel):
            self._send_to(source, channel, answer)

    def channel(self, address: Address, old: bool = False) -> Channel:
        """Return what it keeps of a client, from now on if that is new; old: it speaks MAVLink 1."""
        if address not in self._clients:
            if len(self._clients) >= _CLIENTS:
                known = [a for a in self._clients if a != self._calls]
                del self._clients[min(known, key=lambda a: self._clients[a].heard_ns or 0)]
            encoder = FrameEncoder(self._system, AUTOPILOT_COMPONENT, self._signing)
            rates = Rates(self.firmware, self.speaker.builders)
            clock = SenderClock(learns=self.firmware.flavour is not Flavour.PX4)
            self._clients[address] = Channel(encoder, rates, clock, old)
        return self._clients[address]

    def _is_ground(self, system: int) -> bool:
        mine = self.firmware.parameters.values.get("SYSID_MYGCS")
        return mine is None or system == int(mine)

    def send(self) -> None:
        """End a tick: run the firmware's watchdogs, and send due output."""
        self._ticks += 1
        now_ns = self.now_ns
        self.speaker.boot_us = now_ns // 1000
        silence_s = 0.0 if self._ground_ns is None else (now_ns - self._ground_ns) / 1e9
        self.firmware.step(now_ns / 1e9, silence_s)
        if self._wrong is not None:
            self.speaker.report(now_ns / 1e9, self._wrong)
        built: dict[type[Message], Message | None] = {}
        for address, channel in self._reached():
            for kind, every in list(channel.rates.intervals.items()):
                if self._ticks % every == 0:
                    message = built[kind] if kind in built else built.setdefault(kind, self.speaker.builders[kind]())
                    if message is not None:
                        self._send_to(address, channel, message)
            self._send_list(address, channel)
        if self.firmware.flavour is Flavour.PX4 and self._ticks % _TIMESYNC_TICKS == 0:
            self._send_to_all(s.Timesync(0, now_ns))
        while self.firmware.texts:
            self._say(*self.firmware.texts.popleft())

    def _reached(self) -> Iterator[tuple[Address, Channel]]:
        """Yield the clients that the vehicle sends to: those heard recently, and the one that it calls."""
        if self._calls is not None:
            self.channel(self._calls, self.habits.old_until_greeted)
        patience_ns = NEVER_NS if self.habits.one_partner else _FORGET_NS
        for address, channel in list(self._clients.items()):
            if address == self._calls or channel.is_heard(self.now_ns, patience_ns):
                yield address, channel

    def _say(self, severity: int, text: str) -> None:
        # WIRE (docs/reference/mavlink.md 5.13): pieces of 50 characters. PX4 numbers every text, from 0; the last piece
        # of an ArduPilot's long text is not full. PX4's tab: the text is also sent as an event.
        if self.firmware.flavour is Flavour.PX4:
            text, number = text + "\t", self._texts
            pieces = (len(text) - 1) // _TEXT_SIZE + 1
        else:
            number = self._texts % 65535 + 1 if len(text) > _TEXT_SIZE else 0
            pieces = len(text) // _TEXT_SIZE + 1 if number else 1
        self._texts = (self._texts + 1) % 65536
        for piece in range(pieces):
            part = text[piece * _TEXT_SIZE : (piece + 1) * _TEXT_SIZE]
            self._send_to_all(t.Statustext(severity, part, number, piece))

    def _send_list(self, address: Address, channel: Channel) -> None:
        if (begin := channel.listed) is None:
            return
        names = self.firmware.parameters.names
        for name in names[begin : begin + _LIST_PER_TICK]:
            self._send_to(address, channel, self.services.parameter(name))
        channel.listed = begin + _LIST_PER_TICK if begin + _LIST_PER_TICK < len(names) else None

    def _send_to_all(self, message: Message) -> None:
        for address, channel in self._reached():
            self._send_to(address, channel, message)

    def _send_to(self, address: Address, channel: Channel, message: Message) -> None:
        # Times of signing grow over all channels: a client may come back from another port.
        data = b"" if self.silent else channel.encode(message, self._stamp)
        self._stamp = max(self._stamp, channel.newest_stamp)
        if data:
            with suppress(OSError):  # a full buffer or a vanished client loses packets, as radio does
                self.socket.sendto(data, address)

    def close(self) -> None:
        """Close the port."""
        self.socket.close()
