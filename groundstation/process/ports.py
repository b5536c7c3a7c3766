"""Finds a free port, or a port's holder, by the kernel's tables of sockets and the descriptors of processes."""

import errno
import os
import socket
import sys
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass
from ipaddress import IPv4Address, IPv6Address
from pathlib import Path

_PROC = Path("/proc")
_LISTENING, _ESTABLISHED, _UNCONNECTED = "0A", "01", "07"  # two of TCP, one of UDP (proc_pid_net(5))
_WORD = 8


@dataclass(frozen=True, slots=True)
class Holder:
    """A process that holds a port; pid 0: one that this user may not look at."""

    name: str
    pid: int = 0

    def __str__(self) -> str:
        return f"{self.name} (pid {self.pid})" if self.pid else self.name


_HIDDEN = Holder("another user's process")
_UNSEEN = Holder("a process that cannot be found")


@dataclass(frozen=True, slots=True)
class _Socket:
    address: str
    port: int
    inode: str


def free_port(kind: socket.SocketKind = socket.SOCK_STREAM) -> int:
    """Return a port of loopback that was free a moment ago."""
    with socket.socket(socket.AF_INET, kind) as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


def host_of(endpoint: str) -> str:
    """Return the address in an endpoint of the bus, as in "tls/127.0.0.1:4717"."""
    return endpoint.partition("/")[2].rpartition(":")[0]


def port_of(endpoint: str) -> int:
    """Return the port in an endpoint of the bus."""
    return int(endpoint.rpartition(":")[2])


def holder_of(address: str, port: int, kind: socket.SocketKind = socket.SOCK_STREAM) -> Holder:
    """Return the process that prevents binding an address and port: it holds that address, or all of them."""
    everywhere = ("0.0.0.0", "::")
    inodes = {
        f"socket:[{held.inode}]"
        for held in _sockets(kind)
        if held.port == port and (held.address in (address, *everywhere) or address in ("", *everywhere))
    }
    if not inodes:
        return _UNSEEN  # bound without listening, or gone meanwhile
    return next((holder for pid in _pids() if (holder := _holder(pid, inodes))), _HIDDEN)


def why_refused(error: OSError, address: str, port: int, kind: socket.SocketKind = socket.SOCK_STREAM) -> str:
    """Return why an address and port cannot be bound: the program that holds them, or else the system's error."""
    if error.errno == errno.EADDRINUSE:
        return f"the port is taken by {holder_of(address, port, kind)}"
    return os.strerror(error.errno or 0)


def user_of(peer: tuple[str, int], server: tuple[str, int]) -> int | None:
    """Return the user id of the program at the other end of a TCP connection within this machine, None if unknown.

    A connection that its program has closed counts as unknown: the kernel calls it root's.
    """
    for fields in _lines("tcp"):
        if fields[3] == _ESTABLISHED and (_end(fields[1]), _end(fields[2])) == (peer, server):
            return int(fields[7])
    return None


def networks_in_use() -> set[str]:
    """Return the /24 networks of loopback (as "127.64.1") with an address that somebody listens on."""
    held = (*_sockets(socket.SOCK_STREAM), *_sockets(socket.SOCK_DGRAM))
    return {one.address.rpartition(".")[0] for one in held if one.address.startswith("127.")}


def is_free(address: str, port: int) -> bool:
    """Return whether a TCP port can be listened on now."""
    with socket.socket(socket.AF_INET, socket.SOCK_STREAM) as probe:
        probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            probe.bind((address, port))
        except OSError:
            return False
    return True


def _sockets(kind: socket.SocketKind) -> Iterator[_Socket]:
    name, state = ("tcp", _LISTENING) if kind is socket.SOCK_STREAM else ("udp", _UNCONNECTED)
    for table in (name, f"{name}6"):
        for fields in _lines(table):
            if fields[3] == state:
                yield _Socket(*_end(fields[1]), fields[9])


def _lines(table: str) -> list[list[str]]:
    try:
        return [line.split() for line in (_PROC / "net" / table).read_text().splitlines()[1:]]
    except OSError:
        return []  # a kernel without IPv6, or without this file


def _end(text: str) -> tuple[str, int]:
    address, _, port = text.partition(":")
    return _address(address), int(port, 16)


def _address(text: str) -> str:
    """Return an address as people write it; the kernel prints words of 32 bits in the machine's own order."""
    words = (int(text[at : at + _WORD], 16).to_bytes(4, sys.byteorder) for at in range(0, len(text), _WORD))
    packed = b"".join(words)
    if len(packed) == 4:
        return str(IPv4Address(packed))
    address = IPv6Address(packed)
    return str(address.ipv4_mapped or address)


def _pids() -> list[int]:
    return sorted(int(entry.name) for entry in _PROC.iterdir() if entry.name.isdecimal())


def _holder(pid: int, inodes: set[str]) -> Holder | None:
    folder = _PROC / str(pid)
    with suppress(OSError):  # another user's, or it has just ended
        if any(_target(entry) in inodes for entry in (folder / "fd").iterdir()):
            return Holder((folder / "comm").read_text().strip(), pid)
    return None


def _target(descriptor: Path) -> str:
    try:
        return str(descriptor.readlink())
    except OSError:
        return ""  # closed meanwhile
