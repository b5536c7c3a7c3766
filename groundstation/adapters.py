"""Sockets bound to one network adapter, to distinguish vehicles that all have the same address.

Without such a binding this computer's routes decide, and of two equal ones only the first is ever used.
"""

import errno
import os
import socket
from collections.abc import Sequence
from itertools import product
from pathlib import Path

from groundstation.errors import DriverError

_CONF = Path("/proc/sys/net/ipv4/conf")
_STRICT = 1
Address = tuple[str, int]


def bind_to_adapter(one: socket.socket, interface: str) -> None:
    """Let a new socket send and receive through one network adapter only ("": through any).

    Raises DriverError, which names all adapters or the missing right; the socket is then closed.
    """
    if not interface:
        return
    try:
        # From Linux 5.7 on every user may, once for each socket (socket(7), SO_BINDTODEVICE).
        one.setsockopt(socket.SOL_SOCKET, socket.SO_BINDTODEVICE, interface.encode())
    except OSError as error:
        one.close()
        raise DriverError(f"interface {interface}: {_why(error)}") from error


class UdpSender:
    """Sends datagrams as they are, from a port of its own, through one adapter ("": any); raises DriverError."""

    def __init__(self, interface: str = "") -> None:
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        bind_to_adapter(self._socket, interface)
        self._socket.setblocking(False)

    def send(self, datagram: bytes, addresses: Sequence[Address]) -> None:
        """Send a datagram to each address; raises the last OSError after all have been tried."""
        send_to_all(self._socket, (datagram,), addresses)

    def close(self) -> None:
        """Close the socket; idempotent."""
        self._socket.close()


def send_to_all(udp: socket.socket, datagrams: Sequence[bytes], addresses: Sequence[Address]) -> None:
    """Send datagrams to each address; raises the last OSError after all have been tried."""
    failed: OSError | None = None
    for datagram, address in product(datagrams, addresses):
        try:
            udp.sendto(datagram, address)
        except OSError as error:
            failed = error
    if failed is not None:
        raise failed


def _why(error: OSError) -> str:
    if error.errno == errno.ENODEV:
        return f"there is no such network adapter here, only {', '.join(adapters())}; plugged in? see: ip link"
    if error.errno == errno.EPERM:
        return (
            "this user may not choose the network adapter: Linux before 5.7 allows it with CAP_NET_RAW only; "
            "use a newer one, or run as a user who has it"
        )
    return os.strerror(error.errno or 0)


def connected(address: Address, timeout_s: float, interface: str = "") -> socket.socket:
    """Return a TCP connection through one adapter ("": any) whose waits end after timeout_s.

    Raises OSError without an answer, DriverError for an adapter that cannot be used.
    """
    if not interface:
        return socket.create_connection(address, timeout=timeout_s)
    stream = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
    bind_to_adapter(stream, interface)
    try:
        stream.settimeout(timeout_s)
        stream.connect(address)
    except OSError:
        stream.close()
        raise
    return stream


def split_zone(text: str) -> tuple[str, str]:
    """Return address and adapter of "192.168.1.1%wlan1", as IPv6 writes it; the adapter is "" if none is given."""
    address, _, interface = text.partition("%")
    return address, interface


def with_zone(address: str, interface: str) -> str:
    """Return an address with its adapter, as `split_zone` reads it."""
    return f"{address}%{interface}" if interface else address


def how_to_reach(address: str) -> str:
    """Return a remedy for a vehicle that does not answer.

    address: with or without an adapter, or the target of a link: udpout:ADDRESS:PORT, udpin: likewise, which the
    vehicle calls, or serial:DEVICE:BAUD.
    """
    way, place, number = address.split(":") if address.count(":") == 2 else ("", address, "")
    if way == "udpin":
        return f"check that it is switched on and calls port {number} of this computer, in its network"
    if way == "serial":
        return f"check that it is switched on, and the radios at both ends: this one at {place}, {number} baud"
    host, interface = split_zone(place)
    ping = f"ping -I {interface} {host}" if interface else f"ping {host}"
    return f"check that it is switched on and that this computer is in its network: {ping}"


def adapters() -> list[str]:
    """Return the names of this computer's network adapters."""
    return sorted(name for _, name in socket.if_nameindex())


def drops_strangers(interface: str, conf: Path = _CONF) -> bool:
    """Return whether the kernel drops packets on an adapter from an address that it reaches through another one."""
    values = [int(_text(conf / name / "rp_filter") or 0) for name in ("all", interface)]
    return max(values) == _STRICT


def _text(path: Path) -> str:
    try:
        return path.read_text(encoding="ascii").strip()
    except OSError:
        return ""
