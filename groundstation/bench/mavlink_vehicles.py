"""Vehicles that only send, for the bench: `python -m groundstation.bench.mavlink_vehicles PORT COUNT SECONDS`.

Each accepts every request and streams 50 LOCAL_POSITION_NED, 50 ATTITUDE_QUATERNION and 100 HIGHRES_IMU a second;
the IMU's time is the host's monotonic clock at sending. Its physics is one trembling drift, so that only the host is
measured and no sensor counts as frozen.
"""

import math
import socket
import sys
import time
from contextlib import suppress

from drivers.mavlink.parameters import needed
from drivers.mavlink.wire import flight, service, telemetry
from drivers.mavlink.wire.frames import MAX_DATAGRAM, FrameDecoder, FrameEncoder, Message, split
from drivers.mavlink.wire.names import AUTOPILOT_COMPONENT, Flavour, MavCmd
from drivers.mavlink.wire.parameters import carried_from_value

FIRST_SYSTEM = 11
_TICK_S = 0.01
_HEALTHY = 0b1111
_START_S, _CLIMB_S, _TREMOR = 1.0, 1.0, 0.01
# As fast as the bench asks.
AHEAD_M_S = 0.1


class TalkingVehicle:
    """A PX4 that rises by 1 m once it is armed, then flies ahead at AHEAD_M_S, whatever its commands."""

    def __init__(self, system: int, port: int) -> None:
        self._encoder, self._decoder = FrameEncoder(system, AUTOPILOT_COMPONENT), FrameDecoder()
        self._host = ("127.0.0.1", port)
        self._mode, self._armed_s = 3 << 16, 0.0
        self._parameters = {n.name: n for n in needed(Flavour.PX4, 255)}
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.bind(("127.0.0.1", 0))
        self._socket.setblocking(False)

    def _send(self, message: Message) -> None:
        with suppress(OSError):
            self._socket.sendto(self._encoder.encode(message), self._host)

    def turn(self, tick: int) -> None:
        """Send the messages of a hundredth of a second."""
        self._answer()
        now_ns = time.monotonic_ns()
        self._send(telemetry.HighresImu(now_ns // 1000, _TREMOR * math.sin(tick), 0.0, -9.8, 0.0, 0.0, 0.0))
        if tick % 2:
            self._send(self._position(now_ns, tick))
            half_rad = _TREMOR * math.sin(tick)
            self._send(telemetry.AttitudeQuaternion(0, 1.0, half_rad, 0.0, 0.0, 0.0, 0.0, 0.0))
        if tick % 20 == 0:
            aloft = self._armed_s and time.monotonic() - self._armed_s > _START_S
            self._send(telemetry.ExtendedSysState(0, 2 if aloft else 1))
            self._send(telemetry.Heartbeat(2, Flavour.PX4, 129 if self._armed_s else 1, self._mode, 4))
            self._send(telemetry.SysStatus(_HEALTHY, _HEALTHY, _HEALTHY, battery_remaining=90))

    def _position(self, now_ns: int, tick: int) -> telemetry.LocalPositionNed:
        armed_s = time.monotonic() - self._armed_s if self._armed_s else 0.0
        risen = min(max((armed_s - _START_S) / _CLIMB_S, 0.0), 1.0)
        climb_m_s = 1.0 / _CLIMB_S if 0.0 < risen < 1.0 else 0.0
        ahead_s = max(armed_s - _START_S - _CLIMB_S, 0.0)
        north_m_s, east_m_s = _TREMOR * math.sin(tick), _TREMOR * math.cos(tick)
        if ahead_s:
            north_m_s += AHEAD_M_S
        return telemetry.LocalPositionNed(
            now_ns // 1_000_000 % (1 << 32), AHEAD_M_S * ahead_s, 0.0, -risen, north_m_s, east_m_s, -climb_m_s
        )

    def _answer(self) -> None:
        for _ in range(64):
            try:
                data, _ = self._socket.recvfrom(MAX_DATAGRAM)
            except OSError:
                return
            for raw in split(data):
                self._take(self._decoder.decode(raw).message)

    def _take(self, message: Message | None) -> None:
        match message:
            case flight.CommandLong():
                if message.command == MavCmd.DO_SET_MODE:
                    self._mode = int(message.param2) << 16
                elif message.command == MavCmd.COMPONENT_ARM_DISARM:
                    self._armed_s = time.monotonic() if message.param1 else 0.0
                self._send(flight.CommandAckMessage(message.command, 0, 0, 0, 255, 190))
            case service.ParamRequestRead() if message.param_id in self._parameters:
                wanted = self._parameters[message.param_id]
                carried = carried_from_value(Flavour.PX4, wanted.value, wanted.kind)
                self._send(service.ParamValue(wanted.name, carried, wanted.kind, len(self._parameters), 0))


def main(port: int, count: int, seconds: float) -> None:
    """Send for some seconds, at an even rate."""
    vehicles = [TalkingVehicle(FIRST_SYSTEM + n, port) for n in range(count)]
    due = begin = time.monotonic()
    tick = 0
    while due - begin < seconds:
        tick += 1
        for vehicle in vehicles:
            vehicle.turn(tick)
        due += _TICK_S
        time.sleep(max(0.0, due - time.monotonic()))


if __name__ == "__main__":
    main(int(sys.argv[1]), int(sys.argv[2]), float(sys.argv[3]))
