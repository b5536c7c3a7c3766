"""Obeys the commands of an emulated autopilot, and answers the malformed ones as its firmware does. No sockets.

WIRE (docs/reference/mavlink.md 4, 5.15): an unknown command is answered UNSUPPORTED, never with silence; the answer
names the sender of the request.
"""

import math

from drivers.mavlink.wire import flight as f
from drivers.mavlink.wire import telemetry as t
from drivers.mavlink.wire.frames import Message, ReceivedFrame, id_of
from drivers.mavlink.wire.names import FORCE, Flavour, MavCmd, MavResult
from sim_bridge.devices.mavlink_firmware import AutopilotFirmware
from sim_bridge.devices.mavlink_messages import Speaker
from sim_bridge.devices.mavlink_numbers import nearest, signed_byte, whole
from sim_bridge.devices.mavlink_rates import BY_ID, Rates

Params = tuple[float, ...]
_Requested = tuple[MavResult, list[Message]]
_NO_PLACE, _NAN_AS_INTEGER = 0x7FFFFFFF, 0x7FF80000
# The floats next to the greatest integer.
_NEAR_NO_PLACE = (2147483520.0, 2147483904.0)
_RELATIVE_FRAME = 3


class Commands:
    """Obeys one command after the other; video: what it says of its camera."""

    def __init__(
        self, firmware: AutopilotFirmware, speaker: Speaker, video: t.VideoStreamInformation | None = None
    ) -> None:
        self._firmware, self._speaker, self._video = firmware, speaker, video
        self._px4 = firmware.flavour is Flavour.PX4

    def take(self, frame: ReceivedFrame, message: f.CommandLong | f.CommandInt, rates: Rates) -> list[Message]:
        """Obey a command of a client with these rates; return its acknowledgements, and what it asked for."""
        command = message.command
        params: Params
        if isinstance(message, f.CommandLong):
            params, fault = message[4:], self._fault_of_long(message)
        else:
            params, fault = _params_of(message), self._fault_of_int(message)
        if fault:
            return [_ack(frame, command, MavResult.DENIED)]
        if command == MavCmd.DO_REPOSITION:
            frame_of_place = message.frame if isinstance(message, f.CommandInt) else None
            return [_ack(frame, command, self._firmware.reposition(params, frame_of_place)[0])]
        results, more = self._obey(command, params, rates)
        return [*(_ack(frame, command, result) for result in results), *more]

    def set_mode(self, frame: ReceivedFrame, message: f.SetMode) -> list[Message]:
        """Obey SET_MODE; WIRE (source): a PX4 answers as to DO_SET_MODE, once; ArduPilot 4.5 does not answer."""
        mode = message.custom_mode
        if not self._px4:
            self._firmware.order_mode((message.base_mode, mode))
            return []
        result, _ = self._firmware.order_mode((message.base_mode, mode >> 16 & 0xFF, mode >> 24))
        return [_ack(frame, MavCmd.DO_SET_MODE, result)]

    def _fault_of_long(self, message: f.CommandLong) -> bool:
        # WIRE (PX4 1.15, source): the integer "no place" among floats is a mistake.
        low, high = _NEAR_NO_PLACE
        return self._px4 and all(low <= value <= high for value in (message.param5, message.param6))

    def _fault_of_int(self, message: f.CommandInt) -> bool:
        if self._px4:
            return message.x == message.y == _NAN_AS_INTEGER  # NaN among integers
        # WIRE (ArduPilot 4.5, source): heights above home only.
        return message.command == MavCmd.NAV_TAKEOFF and message.frame != _RELATIVE_FRAME

    def _obey(self, command: int, p: Params, rates: Rates) -> tuple[list[MavResult], list[Message]]:
        firmware = self._firmware
        match command:
            case MavCmd.COMPONENT_ARM_DISARM:
                return self._arm(p), []
            case MavCmd.DO_SET_MODE:
                return [firmware.order_mode(p)[0]], []
            case MavCmd.NAV_TAKEOFF:
                return [firmware.take_off(p[6] if math.isfinite(p[6]) else 0.0)[0]], []
            case MavCmd.NAV_RETURN_TO_LAUNCH:
                return [firmware.go_home()[0]], []
            case MavCmd.NAV_LAND:
                return [firmware.land()[0]], []
            case MavCmd.CONDITION_YAW:
                return [firmware.turn_to(p)[0]], []
            case MavCmd.DO_CHANGE_SPEED:
                return [firmware.set_speed(p)[0]], []
            case MavCmd.DO_PAUSE_CONTINUE:
                return [firmware.pause(p[0])[0]], []
            case MavCmd.SET_MESSAGE_INTERVAL:
                return [rates.set(p)], []
            case MavCmd.DO_SET_HOME:
                return [self._set_home(p)], []
            case _:
                result, more = self._asked(command, p)
                return [result], more

    def _arm(self, p: Params) -> list[MavResult]:
        """Arm or disarm.

        WIRE (source): PX4 1.15 rounds, and answers what is neither with a text alone; ArduPilot 4.5 with UNSUPPORTED.
        """
        firmware = self._firmware
        order = signed_byte(p[0]) if self._px4 else p[0]
        if order not in (0, 1):
            if not self._px4:
                return [MavResult.UNSUPPORTED]
            firmware.say(2, f"Unsupported ARM_DISARM param: {p[0]:.3f}")
            return []
        code = FORCE if nearest(p[1]) == FORCE else 0.0
        return [(firmware.arm(force=code == FORCE) if order else firmware.disarm(code))[0]]

    def _set_home(self, p: Params) -> MavResult:
        # WIRE (source): 1 takes the present place; else latitude, longitude and height have to be numbers.
        here = p[0] > 0.5 if self._px4 else p[0] == 1.0 or p[4] == p[5] == 0.0
        if here:
            return MavResult.ACCEPTED
        if not self._px4 and p[0] != 0.0:
            return MavResult.FAILED
        return MavResult.ACCEPTED if all(map(math.isfinite, p[4:7])) else MavResult.DENIED

    def _asked(self, command: int, p: Params) -> _Requested:
        match command:
            case MavCmd.REQUEST_MESSAGE:
                return self._request(nearest(p[0]) & 0xFFFF if self._px4 else whole(p[0]), whole(p[1]))
            case MavCmd.REQUEST_AUTOPILOT_CAPABILITIES:
                return MavResult.ACCEPTED, [self._speaker.version()]
            case MavCmd.GET_HOME_POSITION:
                result, more = self._request(id_of(t.HomePosition))
                return result if self._px4 or more else MavResult.FAILED, more
            case _:
                return MavResult.UNSUPPORTED, []

    def _request(self, number: int, which: int = 0) -> _Requested:
        kind = BY_ID.get(number)
        # WIRE (VIDEO_STREAM_INFORMATION): the second parameter is the stream's number, 0 for all.
        if kind is t.VideoStreamInformation and self._video is not None and which in (0, self._video.stream_id):
            return MavResult.ACCEPTED, [self._video]
        build = self._speaker.builders.get(kind) if kind is not None else None
        message = build() if build is not None else None
        if message is not None:
            return MavResult.ACCEPTED, [message]
        # WIRE (source): PX4 1.15 denies what it cannot send now. ArduPilot 4.5 fails for unknown messages alone.
        if self._px4:
            return MavResult.DENIED, []
        return MavResult.FAILED if build is None else MavResult.ACCEPTED, []


def _params_of(message: f.CommandInt) -> Params:
    none = message.x == message.y == _NO_PLACE
    place = (math.nan, math.nan) if none else (message.x / 1e7, message.y / 1e7)
    return message.param1, message.param2, message.param3, message.param4, *place, message.z


def _ack(frame: ReceivedFrame, command: int, result: MavResult) -> Message:
    return f.CommandAckMessage(command, result, 0, 0, frame.system, frame.component)
