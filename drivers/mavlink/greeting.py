"""Waits for the first heartbeat of a vehicle, on an open link without another reader or at our own port."""

import time

from drivers.mavlink.links.opening import open_link
from drivers.mavlink.links.seam import MavlinkLink
from drivers.mavlink.settings import LinkSettings
from drivers.mavlink.wire.names import AUTOPILOT_COMPONENT
from drivers.mavlink.wire.telemetry import OUR_HEARTBEAT, Heartbeat
from groundstation.adapters import split_zone, with_zone
from groundstation.errors import DriverError

_CALLS_S = 2.0


def first_heartbeat(
    link: MavlinkLink, system: int, within_s: float, others: set[int] | None = None
) -> Heartbeat | None:
    """Greet a vehicle until its autopilot answers; returns its heartbeat, or None.

    others: gets the systems of other autopilots that are heard meanwhile.
    """
    deadline = time.monotonic() + within_s
    while time.monotonic() < deadline:
        link.send(system, OUR_HEARTBEAT)
        for _, frame in link.receive():
            if frame.component != AUTOPILOT_COMPONENT or not isinstance(frame.message, Heartbeat):
                continue
            if frame.system == system:
                return frame.message
            if others is not None:
                others.add(frame.system)
    return None


def calls_us(settings: LinkSettings, system: int) -> bool:
    """Return whether a vehicle that does not answer at an address calls our port of that number instead.

    False where another program holds that port, so that nobody knows.
    """
    way, place, port = settings.target.split(":")
    if way != "udpout":
        return False
    here = f"udpin:{with_zone('0.0.0.0', split_zone(place)[1])}:{port}"
    try:
        link = open_link(settings.model_copy(update={"target": here}))
    except DriverError:
        return False
    try:
        return first_heartbeat(link, system, _CALLS_S) is not None
    finally:
        link.close()
