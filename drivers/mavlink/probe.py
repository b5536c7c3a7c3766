"""Lists the vehicles on a link: kind and version of each, and its needs for flight."""

import time
from dataclasses import dataclass, field

from drivers.mavlink.identity import serial_number_of
from drivers.mavlink.links.seam import MavlinkLink
from drivers.mavlink.wire.flight import command_to
from drivers.mavlink.wire.frames import id_of
from drivers.mavlink.wire.names import (
    ARMED,
    AUTOPILOT_COMPONENT,
    ESTIMATOR_LOCATED,
    NO_AUTOPILOT,
    Flavour,
    MavCmd,
    mode_name,
)
from drivers.mavlink.wire.telemetry import (
    OUR_HEARTBEAT,
    AutopilotVersion,
    EstimatorStatus,
    Heartbeat,
    LocalPositionNed,
    Statustext,
    SysStatus,
    VideoStreamInformation,
)

_HEARTBEAT_S = 0.5
_EVERYBODY = 0


@dataclass(slots=True)
class Found:
    """The reports of one vehicle about itself."""

    system: int
    autopilot: int
    mode: str = ""
    armed: bool = False
    version: str = ""
    serial_number: str = ""
    battery: str = ""
    video: str = ""
    located: bool = False
    texts: list[str] = field(default_factory=list)
    frames: int = 0

    @property
    def flavour(self) -> str:
        """Return its autopilot in words."""
        words = {flavour.value: flavour.name.lower() for flavour in Flavour}
        return words.get(self.autopilot, f"autopilot {self.autopilot}")


def probe(link: MavlinkLink, seconds: float) -> dict[int, Found]:
    """Return the vehicles that answer within some seconds, by system id; nothing is changed on them."""
    found: dict[int, Found] = {}
    deadline, next_s = time.monotonic() + seconds, 0.0
    while time.monotonic() < deadline:
        if time.monotonic() >= next_s:
            next_s = time.monotonic() + _HEARTBEAT_S
            for system in {_EVERYBODY, *found}:
                link.send(system, OUR_HEARTBEAT)
            for vehicle in found.values():
                _ask(link, vehicle)
        for _, frame in link.receive():
            message = frame.message
            if (
                isinstance(message, Heartbeat)
                and frame.component == AUTOPILOT_COMPONENT
                and message.autopilot != NO_AUTOPILOT
            ):
                vehicle = found.setdefault(frame.system, Found(frame.system, message.autopilot))
                vehicle.autopilot, vehicle.armed = message.autopilot, bool(message.base_mode & ARMED)
                vehicle.mode = _mode(message)
            if frame.system in found:
                found[frame.system].frames += 1
                _note(found[frame.system], message)
    return found


def _ask(link: MavlinkLink, vehicle: Found) -> None:
    for kind, known in ((AutopilotVersion, vehicle.version), (VideoStreamInformation, vehicle.video)):
        if not known:
            link.send(vehicle.system, command_to(vehicle.system, MavCmd.REQUEST_MESSAGE, float(id_of(kind))))
    if not vehicle.battery:
        interval = (float(id_of(SysStatus)), 500_000.0)
        link.send(vehicle.system, command_to(vehicle.system, MavCmd.SET_MESSAGE_INTERVAL, *interval))


def _mode(message: Heartbeat) -> str:
    known = message.autopilot in (Flavour.PX4, Flavour.ARDUPILOT)
    return mode_name(Flavour(message.autopilot), message.custom_mode) if known else f"mode {message.custom_mode}"


def _note(vehicle: Found, message: object) -> None:
    match message:
        case AutopilotVersion():
            raw = message.flight_sw_version
            vehicle.serial_number = serial_number_of(message)
            vehicle.version = f"{raw >> 24}.{raw >> 16 & 255}.{raw >> 8 & 255}"
        case SysStatus() if message.battery_remaining >= 0:
            vehicle.battery = f"{message.battery_remaining} %"
        case VideoStreamInformation():
            vehicle.video = message.uri
        # WIRE (docs/reference/mavlink.md 2.2): a PX4 sends it without a position, too.
        case LocalPositionNed() if vehicle.autopilot != Flavour.PX4:
            vehicle.located = True
        case EstimatorStatus():
            vehicle.located = bool(message.flags & ESTIMATOR_LOCATED)
        case Statustext() if message.text not in vehicle.texts:
            vehicle.texts.append(message.text)
