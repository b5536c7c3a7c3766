"""Waits for the first heartbeat of a vehicle on an open link without another reader."""

import time

from drivers.mavlink.links.seam import MavlinkLink
from drivers.mavlink.wire.names import AUTOPILOT_COMPONENT
from drivers.mavlink.wire.telemetry import OUR_HEARTBEAT, Heartbeat


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
