"""A loopback network of its own for each simulated run, so that two runs at once never meet."""

import fcntl
import os
import socket
from dataclasses import dataclass
from pathlib import Path

from groundstation.errors import GroundStationError

ROUTER_PORT = 7447
_FIRST_DRONE, _FIRST_CAMERA, _STREAM_PORT = 11, 50, 8080
_CANDIDATES = [(a, b) for a in range(64, 128) for b in range(1, 5)]


@dataclass(frozen=True, slots=True)
class Network:
    """127.a.b.0/24, held as long as the lock's descriptor is open here or in a child that inherited it."""

    prefix: str
    lock: int

    @property
    def endpoint(self) -> str:
        """Where the router listens."""
        return f"tcp/{self.prefix}.1:{ROUTER_PORT}"

    def drone_address(self, index: int) -> str:
        """Return the address of an emulated drone."""
        return f"{self.prefix}.{_FIRST_DRONE + index}"

    def stream(self, index: int) -> tuple[str, int]:
        """Return address and port of an emulated network camera."""
        return f"{self.prefix}.{_FIRST_CAMERA + index}", _STREAM_PORT

    def release(self) -> None:
        """Give the network up."""
        os.close(self.lock)


def claim(folder: Path) -> Network:
    """Return the first free network, locked by a file in the folder; raises GroundStationError when none is."""
    for a, b in _CANDIDATES:
        prefix = f"127.{a}.{b}"
        descriptor = os.open(folder / f"{prefix}.lock", os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o600)
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            os.close(descriptor)
            continue
        # Locks are per user and folder; a port that is taken belongs to someone else's run.
        if _is_free(f"{prefix}.1", ROUTER_PORT) and _is_free(f"{prefix}.{_FIRST_CAMERA}", _STREAM_PORT):
            return Network(prefix, descriptor)
        os.close(descriptor)
    raise GroundStationError("no free loopback network is left: are other runs still landing?")


def require_free(endpoint: str) -> None:
    """Raise GroundStationError when something already listens where the router is to."""
    address, _, port = endpoint.removeprefix("tcp/").rpartition(":")
    if not _is_free(address, int(port)):
        raise GroundStationError(
            f"port {port} on {address} is in use: is another ground station running? (groundstation land stops it)"
        )


def _is_free(address: str, port: int) -> bool:
    with socket.socket(socket.AF_INET, socket.SOCK_STREAM) as probe:
        probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            probe.bind((address, port))
        except OSError:
            return False
    return True
