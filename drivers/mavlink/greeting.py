"""Waits for the first heartbeat of a vehicle on an open link without another reader."""

import time

from drivers.mavlink.links.seam import MavlinkLink
from drivers.mavlink.wire.names import AUTOPILOT_COMPONENT
from drivers.mavlink.wire.telemetry import OUR_HEARTBEAT, Heartbeat


def first_heartbeat(link: MavlinkLink, system: int, within_s: float) -> Heartbeat | None:
    """Greet a vehicle until its autopilot answers; returns its heartbeat, or None."""
    deadline = time.monotonic() + within_s
    while time.monotonic() < deadline:
        link.send(system, OUR_HEARTBEAT)
        for _, frame in link.receive():
            from_it = frame.system == system and frame.component == AUTOPILOT_COMPONENT
            if from_it and isinstance(frame.message, Heartbeat):
                return frame.message
    return None
