"""Answers requests to an emulated autopilot: commands, parameters, clocks, missions, fed poses. No sockets.

WIRE (docs/reference/mavlink.md 4, 5.15): a request for another vehicle is ignored; what is malformed is answered as the
firmware answers it, often with silence.
"""

import math
from collections.abc import Iterator

from drivers.mavlink.wire import flight as f
from drivers.mavlink.wire import service as s
from drivers.mavlink.wire import telemetry as t
from drivers.mavlink.wire.file_transfer import refusal
from drivers.mavlink.wire.frames import Message, ReceivedFrame
from drivers.mavlink.wire.names import AUTOPILOT_COMPONENT, Flavour, MavCmd
from drivers.mavlink.wire.parameters import carried_from_value, value_from_carried
from sim_bridge.devices.mavlink_channel import Channel
from sim_bridge.devices.mavlink_commands import Commands
from sim_bridge.devices.mavlink_firmware import AutopilotFirmware
from sim_bridge.devices.mavlink_messages import Speaker
from sim_bridge.devices.mavlink_time import SenderClock

_ALL = 0
# WIRE (PX4 1.15, source): the only messages and commands that a PX4 accepts when they are addressed to all systems.
_FOR_ALL = (f.SetPositionTargetLocalNed, f.SetPositionTargetGlobalInt, s.Ping)
_COMMANDS_FOR_ALL = (MavCmd.REQUEST_AUTOPILOT_CAPABILITIES, MavCmd.REQUEST_PROTOCOL_VERSION)
# WIRE (MAV_MISSION_RESULT).
_MISSION_ACCEPTED, _MISSION_ERROR, _MISSION_UNSUPPORTED, _NO_SUCH_ITEM = 0, 1, 3, 13
_POLE, _ROUND = 900_000_000, 1_800_000_000  # 1e-7 degrees
_FRESH_S = 0.5
_GO_THERE = 2  # of a mission item's `current`


class Services:
    """Handles one frame after the other; `take` returns the answers for its sender."""

    def __init__(
        self, system: int, firmware: AutopilotFirmware, speaker: Speaker, stream: t.VideoStreamInformation | None
    ) -> None:
        self._system, self._firmware, self._speaker = system, firmware, speaker
        self._px4 = firmware.flavour is Flavour.PX4
        self._commands = Commands(firmware, speaker, stream)

    def take(self, frame: ReceivedFrame, now_ns: int, channel: Channel) -> list[Message]:
        """Obey a frame of a client and return the answers."""
        message = frame.message
        itself = (frame.system, frame.component) == (self._system, AUTOPILOT_COMPONENT)
        if message is None or itself or not self._is_for_us(message):
            return []
        match message:
            case f.CommandLong() | f.CommandInt():
                return self._commands.take(frame, message, channel.rates)
            case f.SetMode():
                return self._commands.set_mode(frame, message)
            case f.SetPositionTargetLocalNed():
                self._firmware.fly(message)
            case f.SetPositionTargetGlobalInt():
                self._firmware.fly_on_earth(message)
            case f.VisionPositionEstimate() | f.OdometryMessage():
                self._vision(message, now_ns, channel.clock)
            case s.SetGpsGlobalOrigin():
                return self._set_origin(message)
            case _:
                return list(self._small(frame, message, now_ns, channel))
        return []

    def _is_for_us(self, message: Message) -> bool:
        """Return whether a message is for this autopilot.

        WIRE (source): ArduPilot 4.5 takes what is for all systems, and what is for a component of its own system that
        it has never heard. A PX4 takes what names it, and few messages that are for all.
        """
        target = getattr(message, "target_system", self._system)
        component = getattr(message, "target_component", _ALL)
        if not self._px4:
            return target in (_ALL, self._system)
        if isinstance(message, f.CommandLong | f.CommandInt) and message.command in _COMMANDS_FOR_ALL:
            return target in (_ALL, self._system)
        for_all = target == _ALL and isinstance(message, _FOR_ALL)
        return (for_all or target == self._system) and component in (_ALL, AUTOPILOT_COMPONENT)

    # -- parameters and the rest --------------------------------------------------------------------------------------

    def parameter(self, name: str) -> Message:
        """Return one parameter as it is transmitted."""
        parameters = self._firmware.parameters
        kind = parameters.kind(name)
        carried = carried_from_value(self._firmware.flavour, parameters[name], kind)
        return s.ParamValue(name, carried, kind, len(parameters.names), parameters.names.index(name))

    def _small(self, frame: ReceivedFrame, message: Message, now_ns: int, channel: Channel) -> Iterator[Message]:
        match message:
            case s.ParamRequestRead():
                if name := self._named(message):
                    yield self.parameter(name)
            case s.ParamRequestList():
                channel.listed = 0
            case s.ParamSet() if message.param_id in self._firmware.parameters.names and self._takes(message):
                self._write(message)
                yield self.parameter(message.param_id)
            case s.Timesync() if message.tc1 == 0:
                yield s.Timesync(now_ns, message.ts1)
            case s.Timesync() if message.tc1 > 0:
                channel.clock.synchronise(now_ns, message.tc1, message.ts1)
            case s.Ping() if message.target_system == 0:
                yield s.Ping(message.time_usec, message.seq, frame.system, frame.component)
            case s.MissionRequestList():
                yield s.MissionCount(frame.system, frame.component, 0, message.mission_type)
            case s.MissionRequestInt() if not self._px4:
                # WIRE (ArduCopter 4.7, seen): it repeats how many there are. PX4 ignores what it did not announce.
                yield s.MissionCount(frame.system, frame.component, 0, message.mission_type)
                yield s.MissionAck(frame.system, frame.component, _NO_SUCH_ITEM, message.mission_type)
            case f.MissionItem() if not self._px4 and message.current == _GO_THERE:
                yield s.MissionAck(frame.system, frame.component, self._guide(message), 0)
            case s.MissionCount() | s.MissionClearAll():
                yield _mission_answer(frame, message)
            case s.FileTransferProtocol():
                yield refusal(message, frame.system, frame.component)
            case s.RequestDataStream() if not self._px4 and message.start_stop in (0, 1):
                channel.rates.set_old(message.req_stream_id, message.req_message_rate * message.start_stop)

    def _guide(self, item: f.MissionItem) -> int:
        """Fly to a point at once, as DroneKit's simple_goto asks; WIRE (ArduCopter 4.7, source): in GUIDED only."""
        firmware = self._firmware
        place = firmware.place_on_earth(item.x, item.y, item.z, item.frame)
        if firmware.mode != firmware.guided or place is None:
            return _MISSION_ERROR
        firmware.go(place, None)
        return _MISSION_ACCEPTED

    def _named(self, message: s.ParamRequestRead) -> str:
        """Return the parameter that is asked for, "" if there is none; WIRE (source): then nothing is answered."""
        names, index = self._firmware.parameters.names, message.param_index
        by_name = index < 0 if self._px4 else index == -1
        if by_name:
            return message.param_id if message.param_id in names else ""
        return names[index] if 0 <= index < len(names) else ""

    def _takes(self, message: s.ParamSet) -> bool:
        # WIRE: PX4 1.16 wants the parameter's own type, and takes what is no number. ArduPilot 4.5 (source) has its
        # own, and wants a number. Neither answers otherwise.
        if self._px4:
            return message.param_type == self._firmware.parameters.kind(message.param_id)
        return math.isfinite(message.param_value)

    def _write(self, message: s.ParamSet) -> None:
        parameters = self._firmware.parameters
        kind = parameters.kind(message.param_id)
        value = value_from_carried(self._firmware.flavour, message.param_value, kind)
        parameters.values[message.param_id] = value

    # -- position from outside ----------------------------------------------------------------------------------------

    def _set_origin(self, message: s.SetGpsGlobalOrigin) -> list[Message]:
        # WIRE (docs/reference/mavlink.md 1.1): ignored until the estimator runs.
        on_earth = abs(message.latitude) <= _POLE and abs(message.longitude) <= _ROUND
        if self._speaker.boot_us < 2_000_000 or not on_earth:
            return []
        if not self._px4:
            if self._firmware.origin is not None:
                return []  # WIRE (source): an origin that is set stays, and nothing is said
            self._firmware.say(6, "EKF3 IMU0 origin set")
        self._firmware.origin = (message.latitude, message.longitude, message.altitude)
        return [t.GpsGlobalOrigin(*self._firmware.origin, self._speaker.boot_us)]

    def _vision(self, message: f.VisionPositionEstimate | f.OdometryMessage, now_ns: int, clock: SenderClock) -> None:
        if not self._firmware.parameters.indoor:
            return
        if isinstance(message, f.OdometryMessage):
            usec = message.time_usec
            yaw = self._yaw_of(message)
        else:
            usec = message.usec
            yaw = -message.yaw
        if yaw is None or not all(map(math.isfinite, (message.x, message.y, message.z, yaw))):
            return
        age_s = (now_ns - clock.local_ns(usec * 1000, now_ns)) / 1e9
        estimate = self._firmware.copter.estimate
        if not -_FRESH_S < age_s < _FRESH_S:
            estimate.rejected += 1
            return
        # North-east-down to the world's axes; the pose is as old as it is.
        vx, vy, vz = estimate.velocity
        position = (message.x + vx * age_s, -message.y + vy * age_s, -message.z + vz * age_s)
        estimate.aid(position, yaw, message.reset_counter)

    def _yaw_of(self, message: f.OdometryMessage) -> float | None:
        # WIRE (docs/reference/mavlink.md 1.1, 5.5): ArduPilot takes local FRD with body FRD only, in silence; PX4 NED
        # as well.
        frames = (message.frame_id, message.child_frame_id)
        allowed = {(20, 12)} if not self._px4 else {(1, 12), (1, 1), (20, 12), (20, 20)}
        if frames not in allowed:
            return None
        w, x, y, z = message.q
        return -math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))


def _mission_answer(frame: ReceivedFrame, message: s.MissionCount | s.MissionClearAll) -> Message:
    # WIRE (MAVLink mission protocol): a transfer that is not answered is repeated; there are no missions here.
    sent = isinstance(message, s.MissionCount) and message.count
    kind = _MISSION_UNSUPPORTED if sent else _MISSION_ACCEPTED
    return s.MissionAck(frame.system, frame.component, kind, message.mission_type)
