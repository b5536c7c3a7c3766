"""Opens the link that the settings describe, with its signing key."""

import time
from pathlib import Path

from drivers.mavlink.links.seam import MavlinkLink, Sniffer, Transport, ignore_bytes
from drivers.mavlink.links.serial import SerialLink
from drivers.mavlink.links.udp import UdpLink
from drivers.mavlink.settings import LinkSettings
from drivers.mavlink.wire.verification import Signing
from groundstation.errors import DriverError

_SIGNING_EPOCH_S = 1_420_070_400  # 2015-01-01 UTC


def open_link(settings: LinkSettings, sniffer: Sniffer = ignore_bytes) -> MavlinkLink:
    """Return the link that the settings describe; raises DriverError when it cannot be opened."""
    transport: Transport
    if settings.target.startswith("serial"):
        transport = SerialLink(settings, signing_of(settings), sniffer)
    else:
        transport = UdpLink(settings, signing_of(settings), sniffer)
    if settings.kind == "pymavlink":
        return transport
    # Only here: the native library takes its time to load.
    from drivers.mavlink.links.mavsdk import MavsdkLink

    return MavsdkLink(settings, transport)


def signing_of(settings: LinkSettings) -> Signing | None:
    """Return the key of a signed link, with the time from which we sign; raises DriverError without naming the key."""
    if not settings.key_file:
        return None
    try:
        raw = Path(settings.key_file).read_bytes()
    except OSError as error:
        raise DriverError(f"signing key {settings.key_file}: {error.strerror}") from error
    try:
        key = raw if len(raw) == 32 else bytes.fromhex(raw.decode("ascii").strip())
    except ValueError:
        key = b""
    if len(key) != 32:
        raise DriverError(f"signing key {settings.key_file}: must hold 32 bytes, raw or as 64 hex digits")
    return Signing(key, round((time.time() - _SIGNING_EPOCH_S) * 100_000))
