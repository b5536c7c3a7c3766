"""A conversation with one AR.Drone outside of flight: navdata, AT commands, and single configuration keys.

The caller decides what may be sent: `speaking` feeds the drone's watchdog, which in flight only its pilot may do.
"""

import socket
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass

from drivers.ardrone.dump import parse_dump
from drivers.ardrone.queries import TcpInquirer
from drivers.ardrone.wire import at, navdata
from drivers.ardrone.wire.at import AtCommand
from drivers.ardrone.wire.errors import WireError
from drivers.ardrone.wire.navdata import Navdata
from drivers.ardrone.wire.options import DEMO
from drivers.ardrone.wire.state import StateBit
from groundstation.adapters import bind_to_adapter, split_zone
from groundstation.errors import DriverError

NAVDATA_PORT, AT_PORT, CONTROL_PORT, FTP_PORT = 5554, 5556, 5559, 5551
_ANSWER_S = 1.5
_ACK_S = 0.5
_DUMP_S = 2.5
_TICK_S = 0.025


@dataclass(slots=True)
class NavdataStretch:
    """A stretch of navdata: its packets and duration; mode: bootstrap, demo or full."""

    mode: str
    rate_hz: float
    link_quality: float | None


class Conversation:
    """Sockets to the drone at ADDRESS or ADDRESS%ADAPTER, and the newest packet; raises DriverError for the adapter."""

    def __init__(self, address: str) -> None:
        self._shown, (self._address, interface) = address, split_zone(address)
        self._navdata, self._at = _open(interface), _open(interface)
        self._sequence = 1
        self._numbers: list[int] = []
        self.packet: Navdata | None = None
        self.demo_packet: Navdata | None = None
        self.rejected = 0
        self.speaking = False

    def close(self) -> None:
        """Close the sockets."""
        self._navdata.close()
        self._at.close()

    def say(self, *commands: AtCommand) -> None:
        """Send AT commands, numbered from 1."""
        datagram = at.encode_datagram(commands, self._sequence)
        self._sequence += len(commands)
        self._at.sendto(datagram, (self._address, AT_PORT))

    def listen(self, seconds: float, until: Callable[[], bool] = lambda: False) -> bool:
        """Request navdata and take it for some seconds, or until a condition holds; returns whether that came true."""
        self._numbers.clear()
        deadline_s, request_s = time.monotonic() + seconds, 0.0
        while (now_s := time.monotonic()) < deadline_s:
            if now_s >= request_s and (self.packet is None or self.is_set(StateBit.NAVDATA_BOOTSTRAP)):
                request_s = now_s + 0.1
                self._navdata.sendto(navdata.REQUEST, (self._address, NAVDATA_PORT))
            if self.speaking:
                self.say(at.comwdg())
            self._take(now_s + _TICK_S)
            if until():
                return True
        return False

    def repeat(self, command: AtCommand, until: Callable[[], bool]) -> None:
        """Repeat a command until a condition holds, at most for a while."""
        deadline_s = time.monotonic() + _ACK_S
        while not until() and time.monotonic() < deadline_s:
            self.say(command)
            self.listen(_TICK_S, until)

    def _take(self, until_s: float) -> None:
        while (left_s := until_s - time.monotonic()) > 0:
            self._navdata.settimeout(left_s)
            try:
                datagram, source = self._navdata.recvfrom(navdata.MAX_SIZE + 1)
            except TimeoutError:
                return
            if source[0] != self._address:
                continue
            try:
                self.packet = navdata.decode(datagram)
            except WireError:
                self.rejected += 1
                continue
            self._numbers.append(self.packet.sequence)
            if any(tag == DEMO.tag for tag, _ in self.packet.options):
                self.demo_packet = self.packet

    def is_set(self, bit: StateBit) -> bool:
        """Return a bit of the newest packet's state."""
        return self.packet is not None and bool(self.packet.state & bit)

    def stream(self, seconds: float) -> NavdataStretch:
        """Listen for some seconds and report the received navdata."""
        self.listen(seconds)
        mode = "demo" if self.is_set(StateBit.NAVDATA_DEMO) else "full"
        numbers = self._numbers
        expected = numbers[-1] - numbers[0] + 1 if numbers else 0
        quality = min(1.0, len(numbers) / expected) if expected > 0 else None
        return NavdataStretch(
            "bootstrap" if self.is_set(StateBit.NAVDATA_BOOTSTRAP) else mode, len(numbers) / seconds, quality
        )

    def wait_for_answer(self) -> None:
        """Wait for navdata; raises DriverError when none comes within 1.5 s."""
        if not self.listen(_ANSWER_S, lambda: self.packet is not None):
            text = f"no AR.Drone answers at {self._shown} (navdata, UDP {NAVDATA_PORT}) within {_ANSWER_S:g} s"
            raise DriverError(text)

    def configure(self, key: str, value: str) -> None:
        """Set one key, acknowledged."""
        self.acknowledge()
        self.repeat(at.config(key, value), lambda: self.is_set(StateBit.COMMAND))
        self.acknowledge()

    def acknowledge(self) -> None:
        """Clear the drone's acknowledgement bit."""
        self.repeat(at.ctrl(at.CTRL_ACK), lambda: not self.is_set(StateBit.COMMAND))

    def read_configuration(self, inquirer: TcpInquirer) -> dict[str, str]:
        """Return the configuration of a drone that stands (key -> text), {} when its control port gives none."""
        self.speaking = True
        inquirer.ask_dump()
        self.listen(1.0, lambda: inquirer.listening or inquirer.dump is not None)
        self.say(at.ctrl(at.CTRL_CONFIG_GET))
        self.listen(_DUMP_S, lambda: inquirer.dump is not None)
        self.acknowledge()
        return parse_dump(inquirer.dump or b"")


def _open(interface: str) -> socket.socket:
    one = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    bind_to_adapter(one, interface)
    return one


@contextmanager
def with_standing(address: str) -> Iterator[Conversation]:
    """Yield a conversation with a standing drone, and end it afterwards.

    Raises DriverError when it does not answer, cannot be reached, or its motors may turn: then another program numbers
    its commands.
    """
    line = Conversation(address)
    try:
        line.wait_for_answer()
        if line.is_set(StateBit.FLY):
            raise DriverError(f"{address} flies: land it first")
        yield line
    except OSError as error:
        raise DriverError(f"{address} cannot be reached: {error.strerror or error}") from error
    finally:
        line.close()
