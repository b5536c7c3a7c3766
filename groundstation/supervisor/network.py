"""A separate loopback network for each simulated run, so that simultaneous runs never meet."""

import fcntl
import os
import socket
from dataclasses import dataclass, replace
from ipaddress import IPv4Network
from pathlib import Path

from groundstation.errors import GroundStationError, OperatorMistake
from groundstation.process.ports import holder_of, host_of, is_free, networks_in_use, port_of, why_refused
from groundstation.supervisor import runtime_file

_FIRST_DRONE, _FIRST_CAMERA, _STREAM_PORT = 11, 50, 8080
_PORTS_TRIED = 20
_CANDIDATES = [(a, b) for a in range(64, 128) for b in range(1, 5)]


@dataclass(frozen=True, slots=True)
class Network:
    """127.a.b.0/24, held as long as the lock's descriptor is open here or in a child that inherited it.

    bus_port: of the router; stream_port: of all emulated network cameras. outside: first three numbers of the network
    in which other hosts reach emulated devices, or "".
    """

    prefix: str
    lock: int
    bus_port: int
    stream_port: int
    outside: str = ""

    def of(self, host: str) -> "Network":
        """Return where the emulated devices of another host are, or of this one (""); raises OperatorMistake."""
        if host and not self.outside:
            raise OperatorMistake(f"{host} cannot reach emulated devices on loopback: give --network 192.168.1.0/24")
        return replace(self, prefix=self.outside) if host else self

    @property
    def endpoint(self) -> str:
        """Return where the router listens."""
        return f"tls/{self.prefix}.1:{self.bus_port}"

    def drone_address(self, index: int) -> str:
        """Return the address of an emulated drone."""
        return f"{self.prefix}.{_FIRST_DRONE + index}"

    def stream(self, index: int) -> tuple[str, int]:
        """Return address and port of an emulated network camera."""
        return f"{self.prefix}.{_FIRST_CAMERA + index}", self.stream_port

    def release(self) -> None:
        """Release the network."""
        os.close(self.lock)


def claim(folder: Path, bus_port: int, outside: str = "") -> Network:
    """Return the first free network, locked by a file in the folder, with ports that nobody holds on all addresses.

    bus_port: first choice for the router, as 8080 is for the cameras; the next ones follow. outside: the network of
    emulated devices of other hosts, as A.B.C.0/24. Raises GroundStationError when there is no network or no port.
    """
    reachable = _prefix(outside) if outside else ""
    in_use = networks_in_use()  # used by another user's run too, whose locks are elsewhere
    for a, b in _CANDIDATES:
        prefix = f"127.{a}.{b}"
        if prefix in in_use or (lock := _lock(folder / f"{prefix}.lock")) is None:
            continue
        try:
            return Network(prefix, lock, _free_port(prefix, bus_port), _free_port(prefix, _STREAM_PORT), reachable)
        except GroundStationError:
            os.close(lock)
            raise
    raise GroundStationError(f"all {len(_CANDIDATES)} loopback networks are held by other simulated runs: end some")


def _prefix(network: str) -> str:
    try:
        parsed = IPv4Network(network)
    except ValueError:
        parsed = None
    if parsed is None or parsed.prefixlen != 24:
        raise OperatorMistake(f"--network {network}: must be a network such as 192.168.1.0/24")
    return str(parsed.network_address).rpartition(".")[0]


def _lock(path: Path) -> int | None:
    """Return the descriptor that holds a lock file, None when another run has it."""
    descriptor = os.open(path, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o600)
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        os.close(descriptor)
        return None
    return descriptor


def _free_port(prefix: str, wanted: int) -> int:
    """Return the first free port from `wanted` on in a network where nobody listens: others listen on all addresses."""
    address, last = f"{prefix}.1", min(wanted + _PORTS_TRIED - 1, 65535)
    for port in range(wanted, last + 1):
        if is_free(address, port):
            return port
    raise GroundStationError(
        f"no port from {wanted} to {last} is free for a simulated run: {_taken(address, wanted)}, and so on"
    )


def require_free(endpoint: str) -> None:
    """Raise GroundStationError naming the program that already listens where the router should."""
    address, port = host_of(endpoint), port_of(endpoint)
    if not is_free(address, port):
        raise GroundStationError(
            f"{_taken(address, port)}: end it, or give this ground station another port (--set bus.port=...)"
        )


def require_free_udp(use: str, address: str, port: int) -> None:
    """Raise GroundStationError if a UDP port cannot be had, naming its holder; use: of the port, as the text begins."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        try:
            probe.bind((address, port))
        except OSError as error:
            why = why_refused(error, address, port, socket.SOCK_DGRAM)
            raise GroundStationError(f"{use}: cannot listen on {address}:{port} (UDP): {why}") from None


def _taken(address: str, port: int) -> str:
    holder = holder_of(address, port)
    for record in runtime_file.live_records():
        if holder.pid in (process.pid for process in record.processes):
            return f"port {port} on {address} is taken by the ground station {record.name}, field {record.field}"
    return f"port {port} on {address} is taken by {holder}"
