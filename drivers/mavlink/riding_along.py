"""Filters a second ground station's frames to a vehicle: queries and stops pass, nothing that flies it. Pure."""

import math
from collections.abc import Collection
from enum import Enum

from drivers.mavlink.wire import flight, service
from drivers.mavlink.wire.event_request import REQUEST_EVENT, event_request_of
from drivers.mavlink.wire.frames import IDS, Message
from drivers.mavlink.wire.names import (
    CUSTOM_MODE_ENABLED,
    FORCE,
    CopterMode,
    Flavour,
    MavCmd,
    Px4Auto,
    Px4Main,
    px4_mode,
)


class Passage(Enum):
    """STOP: pass at once and always; PASS: pass if there is room; REFUSE: with an answer; DROP: silently."""

    STOP = "stop"
    PASS = "pass"
    REFUSE = "refuse"
    DROP = "drop"


# Modes in which a vehicle stops by itself: it stands, lands, or is held by a pilot.
_STOPPED: dict[Flavour, dict[int, str]] = {
    Flavour.PX4: {
        px4_mode(Px4Main.AUTO, Px4Auto.HOLD): "HOLD",
        px4_mode(Px4Main.AUTO, Px4Auto.LAND): "LAND",
        px4_mode(Px4Main.POSITION): "POSITION",
    },
    Flavour.ARDUPILOT: {
        mode: mode.name for mode in (CopterMode.LAND, CopterMode.BRAKE, CopterMode.LOITER, CopterMode.POSHOLD)
    },
}
_CHANGE_MODE = 1.0
_QUESTIONS = frozenset((MavCmd.REQUEST_MESSAGE, MavCmd.REQUEST_PROTOCOL_VERSION, MavCmd.REQUEST_AUTOPILOT_CAPABILITIES))
# WIRE (docs/reference/mavlink.md 5.11): values of `current` by which an ArduPilot flies there, or climbs, at once.
_FLOWN_TO = (2, 3)
# Kinds of messages that the field file may allow in addition.
_BY_SETTING = {
    "parameters": frozenset(number for name, number in IDS.items() if name.startswith(("PARAM_REQUEST", "PARAM_SET"))),
    "missions": frozenset(number for name, number in IDS.items() if name.startswith("MISSION_")),
}
_JUDGED = frozenset(IDS[name] for name in ("COMMAND_LONG", "COMMAND_INT", "SET_MODE", "FILE_TRANSFER_PROTOCOL"))
_JUDGED |= {REQUEST_EVENT}


def may_pass(number: int, allowed: Collection[str] = ()) -> bool:
    """Return whether a frame of this kind might not be dropped, so that it is worth verifying."""
    return number in _JUDGED or _is_allowed(number, allowed)


def _is_allowed(number: int, allowed: Collection[str]) -> bool:
    return any(number in _BY_SETTING[name] for name in allowed)


def passage_of(
    number: int, message: Message | None, system: int, flavour: Flavour, allowed: Collection[str] = (), raw: bytes = b""
) -> Passage:
    """Return how to treat a verified frame of a second ground station.

    number: of its kind; message: None if its content is unknown; system: the vehicle; allowed: "parameters",
    "missions"; raw: the frame itself.
    """
    if number == REQUEST_EVENT and raw:
        request = event_request_of(raw)
        # WIRE (docs/reference/mavlink.md 5.11): QGroundControl asks for one at a time, and PX4 answers for each.
        return Passage.PASS if request.system == system and request.first == request.last else Passage.DROP
    match message:
        case flight.CommandLong() | flight.CommandInt() if message.target_system in (0, system):
            return _of_command(message, flavour)
        case flight.SetMode() if message.target_system == system:
            stops = message.base_mode & CUSTOM_MODE_ENABLED and message.custom_mode in _STOPPED[flavour]
            return Passage.STOP if stops else Passage.DROP
        case flight.MissionItem() | flight.MissionItemInt() if message.current in _FLOWN_TO:
            return Passage.REFUSE
        case service.FileTransferProtocol() if message.target_system == system:
            return Passage.REFUSE
    # WIRE (docs/reference/mavlink.md 5.11): its heartbeat would hide the loss of ours, and its clock would disturb the
    # vehicle's.
    return Passage.PASS if _is_allowed(number, allowed) else Passage.DROP


def _of_command(message: flight.CommandLong | flight.CommandInt, flavour: Flavour) -> Passage:
    match message.command:
        case MavCmd.NAV_LAND | MavCmd.DO_FLIGHTTERMINATION:
            return Passage.STOP
        case MavCmd.COMPONENT_ARM_DISARM:
            return Passage.STOP if message.param1 == 0.0 else Passage.REFUSE
        case MavCmd.DO_PAUSE_CONTINUE:
            return Passage.STOP if message.param1 == 0.0 else Passage.REFUSE
        case MavCmd.DO_SET_MODE:
            return Passage.STOP if _mode_of(message, flavour) in _STOPPED[flavour] else Passage.REFUSE
        case MavCmd.DO_REPOSITION:
            return Passage.STOP if flavour is Flavour.PX4 and _goes_nowhere(message) else Passage.REFUSE
        case number if number in _QUESTIONS:
            return Passage.PASS
    return Passage.REFUSE


def _mode_of(message: flight.CommandLong | flight.CommandInt, flavour: Flavour) -> int:
    """Return the custom mode requested by a DO_SET_MODE, -1 if invalid."""
    base, main, sub = message.param1, message.param2, message.param3
    if not (0 <= base < 256 and 0 <= main < 256 and 0 <= sub < 256):
        return -1
    # WIRE (docs/reference/mavlink.md 5.11): without this flag PX4 goes by the others: with that of AUTO it begins a
    # mission, whatever mode is named.
    if not int(base) & CUSTOM_MODE_ENABLED:
        return -1
    return px4_mode(int(main), int(sub)) if flavour is Flavour.PX4 else int(main)


def _goes_nowhere(message: flight.CommandLong | flight.CommandInt) -> bool:
    """Return whether a DO_REPOSITION names no place, height or heading.

    WIRE (docs/reference/mavlink.md 5.11): QGroundControl pauses a PX4 by this; it then holds where it comes to rest.
    """
    if not isinstance(message, flight.CommandLong) or message.param2 != _CHANGE_MODE:
        return False
    return all(map(math.isnan, (message.param4, message.param5, message.param6, message.param7)))


def made_good(message: Message, system: int, flavour: Flavour) -> Message | None:
    """Return the message that must follow a stop so that we notice it, or None.

    WIRE (docs/reference/mavlink.md 5.11): an ArduPilot that is paused stays in GUIDED, and ignores velocities until the
    mode is entered anew: we would not know, and no RESUME of ours would end it.
    """
    pauses = isinstance(message, flight.CommandLong | flight.CommandInt) and message.command == MavCmd.DO_PAUSE_CONTINUE
    if flavour is not Flavour.ARDUPILOT or not pauses:
        return None
    return flight.command_to(system, MavCmd.DO_SET_MODE, CUSTOM_MODE_ENABLED, CopterMode.BRAKE)


def words_of(stop: Message, flavour: Flavour) -> str:
    """Return a stop, as `passage_of` found it, in words for the operator."""
    if isinstance(stop, flight.SetMode):
        return _STOPPED[flavour][stop.custom_mode]
    assert isinstance(stop, flight.CommandLong | flight.CommandInt)
    match stop.command:
        case MavCmd.DO_SET_MODE:
            return _STOPPED[flavour][_mode_of(stop, flavour)]
        case MavCmd.DO_REPOSITION | MavCmd.DO_PAUSE_CONTINUE:
            return "pause"
        case MavCmd.COMPONENT_ARM_DISARM:
            return "motors off" if stop.param2 == FORCE else "disarm"
    return "LAND" if stop.command == MavCmd.NAV_LAND else "flight termination"
