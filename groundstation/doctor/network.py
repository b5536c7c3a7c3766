"""Checks of the ports that a run needs, and of Wi-Fi power saving."""

import shutil
import socket
import subprocess
from pathlib import Path

from groundstation.doctor.finding import Finding, Level, judged

_NETWORKS = Path("/sys/class/net")


def port(number: int, purpose: str) -> Finding:
    """Return a finding on whether a TCP port is free on loopback."""
    with socket.socket(socket.AF_INET, socket.SOCK_STREAM) as probe:
        probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        return _bound(probe, ("127.0.0.1", number), f"port of the {purpose}", "ltnp")


def datagram_port(place: tuple[str, int], purpose: str) -> Finding:
    """Return a finding on whether a UDP port at which a driver waits for its vehicle is free."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        return _bound(probe, place, f"port of {purpose}", "lunp")


def _bound(probe: socket.socket, place: tuple[str, int], subject: str, listed: str) -> Finding:
    number = place[1]
    try:
        probe.bind(place)
    except OSError as error:
        remedy = f"ss -{listed} 'sport = :{number}' names the program"
        return Finding(Level.SHOULD, subject, f"{number}: {error.strerror}", remedy)
    return Finding(Level.OK, subject, f"{number} is free")


def power_saving(networks: Path = _NETWORKS, program: str = "iw") -> list[Finding]:
    """Return a finding for each Wi-Fi adapter: power saving delays datagrams by 100 ms and more."""
    adapters = sorted(path.parent.name for path in networks.glob("*/wireless"))
    return [_adapter(name, program) for name in adapters]


def _adapter(name: str, program: str) -> Finding:
    subject, remedy, unknown = f"Wi-Fi {name}", f"iw dev {name} set power_save off", "power saving is not known"
    if not shutil.which(program):
        return Finding(Level.SHOULD, subject, f"{unknown}: iw is not installed", f"install iw; {remedy}")
    try:
        answer = subprocess.run([program, "dev", name, "get", "power_save"], capture_output=True, text=True, timeout=5)
    except (OSError, subprocess.TimeoutExpired) as error:
        return Finding(Level.SHOULD, subject, f"{unknown}: {error}", remedy)
    told = {"on", "off"} & set(answer.stdout.lower().split())
    if answer.returncode or len(told) != 1:
        words = (answer.stderr or answer.stdout).strip().partition("\n")[0] or f"iw ends with {answer.returncode}"
        return Finding(Level.SHOULD, subject, f"{unknown}: {words}", remedy)
    return judged(told == {"off"}, Level.SHOULD, subject, f"power saving {told.pop()}", remedy)
