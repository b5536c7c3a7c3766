"""Answers requests to an emulated autopilot: commands, parameters, rates, clocks, fed poses. No sockets.

WIRE (docs/reference/mavlink.md 4): an unknown command is answered UNSUPPORTED, never with silence; a request for
another vehicle is ignored; the answer names the sender of the request.
"""

import math
from collections.abc import Iterator

from drivers.mavlink.wire import flight as f
from drivers.mavlink.wire import service as s
from drivers.mavlink.wire import telemetry as t
from drivers.mavlink.wire.errors import WireError
from drivers.mavlink.wire.file_transfer import refusal
from drivers.mavlink.wire.frames import CLASSES, Message, ReceivedFrame, id_of
from drivers.mavlink.wire.names import AUTOPILOT_COMPONENT, Flavour, MavCmd, MavResult, px4_mode
from drivers.mavlink.wire.parameters import carried_from_value, value_from_carried
from drivers.mavlink.wire.positioning import GlobalPositionInt, GpsRawInt
from sim_bridge.devices.mavlink_firmware import Answer, AutopilotFirmware
from sim_bridge.devices.mavlink_messages import Speaker
from sim_bridge.devices.mavlink_time import SenderClock

TICK_HZ = 200.0
_PX4_RATES: dict[type[Message], float] = {
    t.HighresImu: 50, t.LocalPositionNed: 30, f.OdometryMessage: 30, t.Attitude: 100, t.AttitudeQuaternion: 50,
    t.SysStatus: 5, t.ExtendedSysState: 5, t.EstimatorStatus: 1, t.BatteryStatus: 0.5, t.HomePosition: 0.5,
}  # fmt: skip
_GLOBAL_RATES: dict[type[Message], float] = {GlobalPositionInt: 50, GpsRawInt: 8}
# WIRE (REQUEST_DATA_STREAM): messages that ArduPilot sends for each number of a stream; 0 is all of them.
_OLD_STREAMS: dict[int, tuple[type[Message], ...]] = {
    2: (t.SysStatus, t.ExtendedSysState, GpsRawInt),
    6: (t.LocalPositionNed, GlobalPositionInt),
    10: (t.Attitude,),
    12: (t.BatteryStatus, t.EkfStatusReport),
}
_UNSUPPORTED: Answer = (MavResult.UNSUPPORTED, "")
_OK: Answer = (MavResult.ACCEPTED, "")
_MISSION_UNSUPPORTED, _NO_SUCH_ITEM = 3, 13
_FRESH_S = 0.5


class Services:
    """Handles one frame after the other; `take` returns the answers for its sender."""

    def __init__(
        self, system: int, firmware: AutopilotFirmware, speaker: Speaker, stream: t.VideoStreamInformation | None
    ) -> None:
        self._system, self._firmware, self._speaker, self._stream = system, firmware, speaker, stream
        px4 = firmware.flavour is Flavour.PX4
        self.intervals: dict[type[Message], int] = {t.Heartbeat: 200}
        if px4:
            self._send_unasked(_PX4_RATES)
        self.clock = SenderClock(learns=not px4)
        self._by_id = {id_of(kind): kind for kind in CLASSES.values()}

    def _send_unasked(self, rates: dict[type[Message], float]) -> None:
        self.intervals |= {kind: max(1, round(TICK_HZ / hz)) for kind, hz in rates.items()}

    def stream_global_position(self) -> None:
        """Send the messages that a PX4 with satellites sends unasked."""
        if self._firmware.flavour is Flavour.PX4 and self._firmware.global_position:
            self._send_unasked(_GLOBAL_RATES)

    def take(self, frame: ReceivedFrame, now_ns: int) -> list[Message]:
        """Obey a frame and return the answers."""
        message = frame.message
        target = getattr(message, "target_system", 0)
        if message is None or target not in (0, self._system):
            return []
        if getattr(message, "target_component", 0) not in (0, AUTOPILOT_COMPONENT):
            return []
        match message:
            case f.CommandLong():
                params = message[4:]
                return self._command(frame, message.command, params)
            case f.CommandInt():
                params = (message.param1, message.param2, message.param3, message.param4, 0.0, 0.0, message.z)
                return self._command(frame, message.command, params)
            case f.SetMode():
                self._firmware.set_mode(message.custom_mode)
            case f.SetPositionTargetLocalNed():
                self._firmware.fly(message)
            case f.VisionPositionEstimate() | f.OdometryMessage():
                self._vision(message, now_ns)
            case s.SetGpsGlobalOrigin():
                return self._set_origin(message)
            case _:
                return list(self._small(frame, message, now_ns))
        return []

    # -- commands -----------------------------------------------------------------------------------------------------

    def _command(self, frame: ReceivedFrame, command: int, p: tuple[float, ...]) -> list[Message]:
        (result, _), more = self._obey(command, p)
        return [f.CommandAckMessage(command, result, 0, 0, frame.system, frame.component), *more]

    def _obey(self, command: int, p: tuple[float, ...]) -> tuple[Answer, list[Message]]:
        firmware = self._firmware
        match command:
            case MavCmd.COMPONENT_ARM_DISARM:
                return (firmware.arm(p[1] == 21196.0) if p[0] == 1.0 else firmware.disarm(p[1])), []
            case MavCmd.DO_SET_MODE:
                return self._set_mode(p), []
            case MavCmd.NAV_TAKEOFF:
                return firmware.take_off(p[6] if math.isfinite(p[6]) else 0.0), []
            case MavCmd.NAV_LAND:
                return firmware.land(), []
            case MavCmd.DO_REPOSITION:
                return firmware.reposition(p), []
            case MavCmd.DO_PAUSE_CONTINUE:
                return firmware.pause(goes_on=p[0] != 0.0), []
            case MavCmd.SET_MESSAGE_INTERVAL:
                return self._set_interval(p), []
            case MavCmd.REQUEST_MESSAGE:
                return self._request(_number(p[0]), _number(p[1]))
            case MavCmd.REQUEST_AUTOPILOT_CAPABILITIES:
                return _OK, [self._speaker.version()]
            case MavCmd.GET_HOME_POSITION:
                return self._request(id_of(t.HomePosition))
            case MavCmd.DO_SET_HOME:
                return _OK, []
            case _:
                return _UNSUPPORTED, []

    def _set_mode(self, p: tuple[float, ...]) -> Answer:
        main, sub = _number(p[1]), _number(p[2])
        return self._firmware.set_mode(px4_mode(main, sub) if self._firmware.flavour is Flavour.PX4 else main)

    def _set_interval(self, p: tuple[float, ...]) -> Answer:
        number, interval_us = _number(p[0]), p[1]
        kind = self._by_id.get(number)
        if kind is None or kind not in self._speaker.builders or not math.isfinite(interval_us):
            ardupilot = self._firmware.flavour is Flavour.ARDUPILOT
            self._firmware.say(4, f"No ap_message for mavlink id ({number})") if ardupilot else None
            return (MavResult.DENIED if ardupilot else MavResult.UNSUPPORTED), ""
        if interval_us < 0:
            self.intervals.pop(kind, None)
        elif interval_us > 0:
            self.intervals[kind] = max(1, round(interval_us * 1e-6 * TICK_HZ))
        return _OK

    def _request(self, number: int, which: int = 0) -> tuple[Answer, list[Message]]:
        kind = self._by_id.get(number)
        # WIRE (VIDEO_STREAM_INFORMATION): the second parameter is the stream's number, 0 for all.
        if kind is t.VideoStreamInformation and self._stream is not None and which in (0, self._stream.stream_id):
            return _OK, [self._stream]
        build = self._speaker.builders.get(kind) if kind is not None else None
        message = build() if build is not None else None
        return (_OK, [message]) if message is not None else ((MavResult.DENIED, ""), [])

    # -- parameters and the rest --------------------------------------------------------------------------------------

    def parameter(self, name: str) -> Message:
        """Return one parameter as it is transmitted."""
        parameters = self._firmware.parameters
        kind = parameters.kind(name)
        carried = carried_from_value(self._firmware.flavour, parameters[name], kind)
        return s.ParamValue(name, carried, kind, len(parameters.names), parameters.names.index(name))

    def _small(self, frame: ReceivedFrame, message: Message, now_ns: int) -> Iterator[Message]:
        names = self._firmware.parameters.names
        match message:
            case s.ParamRequestRead():
                name = message.param_id if message.param_index < 0 else ""
                if 0 <= message.param_index < len(names):
                    name = names[message.param_index]
                if name in names:
                    yield self.parameter(name)
            case s.ParamSet() if message.param_id in names:
                self._write(message)
                yield self.parameter(message.param_id)
            case s.Timesync() if message.tc1 == 0:
                yield s.Timesync(now_ns, message.ts1)
            case s.Timesync():
                self.clock.synchronise(now_ns, message.tc1, message.ts1)
            case s.Ping() if message.target_system == 0:
                yield s.Ping(message.time_usec, message.seq, frame.system, frame.component)
            case s.MissionRequestList():
                yield s.MissionCount(frame.system, frame.component, 0, message.mission_type)
            case s.MissionCount() | s.MissionClearAll() | s.MissionRequestInt():
                yield _mission_answer(frame, message)
            case s.FileTransferProtocol():
                yield refusal(message, frame.system, frame.component)
            case s.RequestDataStream() if self._firmware.flavour is Flavour.ARDUPILOT and message.start_stop in (0, 1):
                self._old_rates(message.req_stream_id, message.req_message_rate * message.start_stop)

    def _write(self, message: s.ParamSet) -> None:
        parameters = self._firmware.parameters
        kind = parameters.kind(message.param_id)
        try:
            value = value_from_carried(self._firmware.flavour, message.param_value, kind)
        except WireError:
            return
        parameters.values[message.param_id] = value

    def _old_rates(self, stream: int, rate_hz: int) -> None:
        """Send a stream at a rate from now on, in place of earlier requests; 0: no more."""
        for number, kinds in _OLD_STREAMS.items():
            for kind in kinds if stream in (0, number) else ():
                if rate_hz:
                    self.intervals[kind] = max(4, round(TICK_HZ / rate_hz))
                else:
                    self.intervals.pop(kind, None)

    # -- position from outside ----------------------------------------------------------------------------------------

    def _set_origin(self, message: s.SetGpsGlobalOrigin) -> list[Message]:
        # WIRE (docs/reference/mavlink.md 1.1): ignored until the estimator runs.
        if self._speaker.boot_us < 2_000_000:
            return []
        if self._firmware.flavour is Flavour.ARDUPILOT:
            if self._firmware.origin is not None:
                return []  # WIRE (source): an origin that is set stays, and nothing is said
            self._firmware.say(6, "EKF3 IMU0 origin set")
        self._firmware.origin = (message.latitude, message.longitude, message.altitude)
        return [t.GpsGlobalOrigin(*self._firmware.origin, self._speaker.boot_us)]

    def _vision(self, message: f.VisionPositionEstimate | f.OdometryMessage, now_ns: int) -> None:
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
        age_s = (now_ns - self.clock.local_ns(usec * 1000, now_ns)) / 1e9
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
        allowed = {(20, 12)} if self._firmware.flavour is Flavour.ARDUPILOT else {(1, 12), (1, 1), (20, 12), (20, 20)}
        if frames not in allowed:
            return None
        w, x, y, z = message.q
        return -math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))


def _mission_answer(frame: ReceivedFrame, message: s.MissionCount | s.MissionClearAll | s.MissionRequestInt) -> Message:
    # WIRE (MAVLink mission protocol): a transfer that is not answered is repeated; there are no missions here.
    match message:
        case s.MissionRequestInt():
            kind = _NO_SUCH_ITEM
        case s.MissionCount(count=count) if count:
            kind = _MISSION_UNSUPPORTED
        case _:
            kind = 0
    return s.MissionAck(frame.system, frame.component, kind, message.mission_type)


def _number(value: float) -> int:
    return int(value) if math.isfinite(value) and abs(value) < 1e9 else -1
