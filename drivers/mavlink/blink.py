"""Lets a disarmed MAVLink vehicle play a tune, to show which one it is."""

import time

from drivers.mavlink.greeting import first_heartbeat
from drivers.mavlink.links.opening import open_link
from drivers.mavlink.links.seam import MavlinkLink
from drivers.mavlink.settings import MavlinkDriverSettings
from drivers.mavlink.wire.names import ARMED, AUTOPILOT_COMPONENT
from drivers.mavlink.wire.service import PlayTune
from groundstation.errors import DriverError

_CONNECT_S, _LASTS_S = 5.0, 4.0
# WIRE (docs/reference/mavlink.md 5.12): music macro language, 30 characters at most; a rising triad, three times.
_TUNE = "MFT200L8O3CEGCEGCEGO4C"


def blink(section: str, name: str) -> str:
    """Let a vehicle play a tune; returns a description of it. section: the driver's, as JSON.

    Raises DriverError when it does not answer, or is armed.
    """
    settings = MavlinkDriverSettings.model_validate_json(section)
    (system,) = (vehicle.system_id for vehicle in settings.vehicles if vehicle.name == name)
    link = open_link(settings.link)
    try:
        _require_standing(link, system)
        link.send(system, PlayTune(system, AUTOPILOT_COMPONENT, _TUNE, ""))
        _listen(link, _LASTS_S)
    finally:
        link.close()
    return "it played a rising tune, if it has a buzzer"


def _require_standing(link: MavlinkLink, system: int) -> None:
    heartbeat = first_heartbeat(link, system, _CONNECT_S)
    if heartbeat is None:
        raise DriverError(f"system {system} does not answer within {_CONNECT_S:g} s")
    if heartbeat.base_mode & ARMED:
        raise DriverError(f"system {system} is armed: land and disarm it first")


def _listen(link: MavlinkLink, seconds: float) -> None:
    deadline = time.monotonic() + seconds
    while time.monotonic() < deadline:
        link.receive()
