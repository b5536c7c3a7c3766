"""A disarmed MAVLink vehicle says which one it is: it plays a tune."""

import time

from drivers.mavlink.links.opening import open_link
from drivers.mavlink.links.seam import MavlinkLink
from drivers.mavlink.settings import MavlinkDriverSettings
from drivers.mavlink.wire.names import ARMED, AUTOPILOT_COMPONENT
from drivers.mavlink.wire.service import PlayTune
from drivers.mavlink.wire.telemetry import OUR_HEARTBEAT, Heartbeat
from groundstation.errors import DriverError

_CONNECT_S, _LASTS_S = 5.0, 4.0
# WIRE (docs/reference/mavlink.md 5.12): music macro language, 30 characters at most; a rising triad, three times.
_TUNE = "MFT200L8O3CEGCEGCEGO4C"


def blink(section: str, name: str) -> str:
    """Let a vehicle play a tune; returns what to listen for. section: the driver's, as JSON.

    Raises DriverError when it does not answer, or is armed.
    """
    settings = MavlinkDriverSettings.model_validate_json(section)
    (system,) = (vehicle.system_id for vehicle in settings.vehicles if vehicle.name == name)
    link = open_link(settings.link)
    try:
        _wait_for(link, system)
        link.send(system, PlayTune(system, AUTOPILOT_COMPONENT, _TUNE, ""))
        _listen(link, _LASTS_S)
    finally:
        link.close()
    return "it played a rising tune, if it has a buzzer"


def _wait_for(link: MavlinkLink, system: int) -> None:
    deadline = time.monotonic() + _CONNECT_S
    while time.monotonic() < deadline:
        link.send(system, OUR_HEARTBEAT)
        for _, frame in link.receive():
            if (
                frame.system != system
                or frame.component != AUTOPILOT_COMPONENT
                or not isinstance(frame.message, Heartbeat)
            ):
                continue
            if frame.message.base_mode & ARMED:
                raise DriverError(f"system {system} is armed: land and disarm it first")
            return
    raise DriverError(f"system {system} does not answer within {_CONNECT_S:g} s")


def _listen(link: MavlinkLink, seconds: float) -> None:
    deadline = time.monotonic() + seconds
    while time.monotonic() < deadline:
        link.receive()
