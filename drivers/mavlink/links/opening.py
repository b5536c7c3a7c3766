"""Opens the link that the settings describe, with its signing key."""

from collections.abc import Callable

from drivers.mavlink.links.seam import MavlinkLink, Sniffer, Transport, ignore_bytes
from drivers.mavlink.links.serial import SerialLink
from drivers.mavlink.links.udp import UdpLink
from drivers.mavlink.settings import LinkSettings
from drivers.mavlink.signing_clock import SigningClock
from drivers.mavlink.signing_key import read_key
from drivers.mavlink.wire.verification import Signing


def open_link(
    settings: LinkSettings,
    sniffer: Sniffer = ignore_bytes,
    shown: Callable[[Transport], Transport] = lambda transport: transport,
) -> MavlinkLink:
    """Return the link that the settings describe; raises DriverError when it cannot be opened.

    shown: wraps the transport so that others see its traffic as well.
    """
    transport: Transport
    if settings.target.startswith("serial"):
        transport = SerialLink(settings, signing_of(settings), sniffer)
    else:
        transport = UdpLink(settings, signing_of(settings), sniffer)
    transport = shown(transport)
    if settings.kind == "pymavlink":
        return transport
    # Only here: the native library is slow to load.
    from drivers.mavlink.links.mavsdk import MavsdkLink

    return MavsdkLink(settings, transport)


def signing_of(settings: LinkSettings) -> Signing | None:
    """Return the key of a signed link and the time from which we sign; raises DriverError without naming the key."""
    if not settings.key_file:
        return None
    return Signing(read_key(settings.key_file), SigningClock().stamp())
