"""Settings by which an AR.Drone joins a network and accepts one owner; they survive power-off.

WIRE (docs/reference/ardrone.md 1, 5.4): `network:owner_mac` makes the drone's firewall drop all others, zeros undo it;
`network:wifi_mode` 2 with `network:ssid_single_player` lets its start script join a network and take a free address.
"""

import fcntl
import re
import socket
import struct
from collections.abc import Mapping
from pathlib import Path

from drivers.ardrone.conversation import CONTROL_PORT, FTP_PORT, with_standing
from drivers.ardrone.queries import TcpInquirer
from drivers.ardrone.wire import at
from groundstation.adapters import bind_to_adapter, split_zone
from groundstation.errors import DriverError

UNPAIRED = "00:00:00:00:00:00"
_OWNER, _MODE, _SSID = "network:owner_mac", "network:wifi_mode", "network:ssid_single_player"
_ACCESS_POINT, _CLIENT = "0", "2"
# WIRE (IEEE 802.11): a network's name has 32 octets at most. A quote or a comma would end the AT command's argument.
_NAME = re.compile(r"[ !#-+\--~]{1,32}")
_HARDWARE_ADDRESS = re.compile(r"([0-9A-Fa-f]{2}:){5}[0-9A-Fa-f]{2}")
_SIOCGIFADDR = 0x8915
_TRIMS = 3


def pairing(owner: str) -> dict[str, str]:
    """Return the settings that make a drone obey one hardware address only (UNPAIRED: any); raises DriverError."""
    if _HARDWARE_ADDRESS.fullmatch(owner) is None:
        raise DriverError(f"{owner!r} is no hardware address, such as 00:1a:2b:3c:4d:5e")
    return {_OWNER: owner.lower()}


def membership(name: str) -> dict[str, str]:
    """Return the settings that make a drone join a network at its next start ("": be an access point again)."""
    if not name:
        return {_MODE: _ACCESS_POINT}
    if _NAME.fullmatch(name) is None:
        raise DriverError(f"{name!r} cannot be set: 1 to 32 plain characters without quotes and commas")
    return {_SSID: name, _MODE: _CLIENT}


def own_hardware_address(drone: str) -> str:
    """Return the hardware address that this computer shows to a drone, ADDRESS or ADDRESS%ADAPTER; or DriverError."""
    drone, adapter = split_zone(drone)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        bind_to_adapter(probe, adapter)
        try:
            probe.connect((drone, 9))
        except OSError as error:
            raise DriverError(f"{drone} cannot be reached: {error.strerror or error}") from error
        ours = probe.getsockname()[0]
        for _, interface in socket.if_nameindex():
            if adapter in ("", interface) and _address_of(probe, interface) == ours:
                found = Path(f"/sys/class/net/{interface}/address").read_text(encoding="ascii").strip()
                if found != UNPAIRED:
                    return found
    raise DriverError(f"the way to {drone} has no hardware address: name the owner's")


def _address_of(any_socket: socket.socket, interface: str) -> str:
    try:
        answer = fcntl.ioctl(any_socket.fileno(), _SIOCGIFADDR, struct.pack("256s", interface.encode()[:15]))
    except OSError:  # the adapter has no such address
        return ""
    return socket.inet_ntoa(answer[20:24])


def trim(address: str) -> None:
    """Let a standing drone take its present attitude as level, until it is switched off.

    Raises DriverError when it does not answer, or its motors may turn.
    """
    with with_standing(address) as line:
        for _ in range(_TRIMS):
            line.say(at.ftrim())  # repeated: datagrams get lost, and there is no acknowledgement
            line.listen(0.05)


def change(address: str, wanted: Mapping[str, str]) -> dict[str, tuple[str, str]]:
    """Write settings of a standing drone and read them back; returns key -> (before, after) of all of them.

    Raises DriverError when it does not answer, flies, or gives no configuration.
    """
    with with_standing(address) as line:
        before = line.read_configuration(TcpInquirer(address, FTP_PORT, CONTROL_PORT))
        if not before:
            raise DriverError(f"{address} gives no configuration (TCP {CONTROL_PORT}): nothing was changed")
        for key, value in wanted.items():
            if before.get(key, "") != value:
                line.configure(key, value)
        after = line.read_configuration(TcpInquirer(address, FTP_PORT, CONTROL_PORT))
        return {key: (before.get(key, ""), after.get(key, "")) for key in wanted}
