"""Which messages one client of an emulated autopilot gets, and how often. No sockets.

WIRE (PX4 and ArduPilot, source): rates belong to a link; the requests of another one do not change them.
"""

from collections.abc import Collection

from drivers.mavlink.wire import flight as f
from drivers.mavlink.wire import telemetry as t
from drivers.mavlink.wire.frames import CLASSES, Message, id_of
from drivers.mavlink.wire.names import Flavour, MavResult
from drivers.mavlink.wire.positioning import GlobalPositionInt, GpsRawInt
from sim_bridge.devices.mavlink_firmware import AutopilotFirmware
from sim_bridge.devices.mavlink_numbers import nearest, whole

TICK_HZ = 200.0
_HEARTBEAT_TICKS = 200
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
# WIRE (ArduPilot 4.5, source): longer intervals count as a minute.
_LONGEST_US = 60_000_000
BY_ID: dict[int, type[Message]] = {id_of(kind): kind for kind in CLASSES.values()}


class Rates:
    """The streams of one client. intervals: ticks between two messages of a kind; known: kinds that can be sent."""

    def __init__(self, firmware: AutopilotFirmware, known: Collection[type[Message]]) -> None:
        self._firmware, self._known = firmware, known
        self._px4 = firmware.flavour is Flavour.PX4
        rates = dict(_PX4_RATES) if self._px4 else {}
        if self._px4 and firmware.global_position:
            rates |= _GLOBAL_RATES
        self._unasked = {t.Heartbeat: _HEARTBEAT_TICKS} | {kind: _ticks(hz) for kind, hz in rates.items()}
        self.intervals: dict[type[Message], int] = dict(self._unasked)

    def set(self, params: tuple[float, ...]) -> MavResult:
        """Take the parameters of SET_MESSAGE_INTERVAL: number, interval [us]; -1 stops, 0 is the default."""
        return self._set_of_px4(params) if self._px4 else self._set_of_ardupilot(params)

    def _set_of_px4(self, p: tuple[float, ...]) -> MavResult:
        # WIRE (PX4 1.15, source): FAILED for heartbeats, unknown messages and any use of parameters 3, 4 and 7. Every
        # negative interval stops; an interval that is no number is the default.
        kind = BY_ID.get(nearest(p[0]))
        if kind is None or kind is t.Heartbeat or kind not in self._known or any(map(nearest, (p[2], p[3], p[6]))):
            return MavResult.FAILED
        if p[1] < 0.0:
            self.intervals.pop(kind, None)
        elif p[1] > 0.0:
            self.intervals[kind] = _ticks(1e6 / p[1])
        else:
            self._reset(kind)
        return MavResult.ACCEPTED

    def _set_of_ardupilot(self, p: tuple[float, ...]) -> MavResult:
        # WIRE (ArduPilot 4.5, source): numbers are cut, not rounded. Only -1 stops: any other negative interval is a
        # millisecond, as is a shorter one, and no stream is faster than the main loop.
        number, interval_us = whole(p[0]), whole(p[1])
        kind = BY_ID.get(number)
        if kind is None or kind not in self._known:
            self._firmware.say(6, f"No ap_message for mavlink id ({number & 0xFFFFFFFF})")
            return MavResult.DENIED
        if interval_us == -1:
            self.intervals.pop(kind, None)
        elif interval_us == 0:
            self._reset(kind)
        else:
            self.intervals[kind] = _ticks(1e6 / min(max(interval_us, 1000), _LONGEST_US))
        return MavResult.ACCEPTED

    def _reset(self, kind: type[Message]) -> None:
        self.intervals.pop(kind, None)
        self.intervals |= {kind: self._unasked[kind]} if kind in self._unasked else {}

    def set_old(self, stream: int, rate_hz: int) -> None:
        """Send a stream of REQUEST_DATA_STREAM at a rate from now on, in place of earlier requests; 0: no more."""
        for number, kinds in _OLD_STREAMS.items():
            for kind in kinds if stream in (0, number) else ():
                if rate_hz:
                    self.intervals[kind] = max(4, round(TICK_HZ / rate_hz))
                else:
                    self.intervals.pop(kind, None)


def _ticks(rate_hz: float) -> int:
    return max(1, round(TICK_HZ / rate_hz))
