"""The true state of an emulated vehicle over MAVLink, as the simulators behind real firmwares send it."""

import socket
from contextlib import suppress

from drivers.mavlink.wire.frames import FrameEncoder, Message
from drivers.mavlink.wire.names import AUTOPILOT_COMPONENT, Flavour
from drivers.mavlink.wire.simulator import HilStateQuaternion, SimState
from groundstation.geometry.angles import quaternion_from_euler
from sim_bridge.devices.mavlink_satellites import Satellites
from sim_bridge.world.airframe import Airframe

Address = tuple[str, int]
_EVERY_TICKS = {Flavour.ARDUPILOT: 4, Flavour.PX4: 8}  # 50 Hz when asked, 25 Hz


class TruthTeller:
    """Sends SIM_STATE (ArduPilot) or HIL_STATE_QUATERNION (PX4) to one address; `send` once per tick."""

    def __init__(self, flavour: Flavour, system: int, body: Airframe, to: Address) -> None:
        self._flavour, self._body, self._to = flavour, body, to
        self._globe = Satellites(system)
        self._encoder = FrameEncoder(system, AUTOPILOT_COMPONENT)
        self._ticks = 0
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.setblocking(False)

    def send(self) -> None:
        """Send the true state when it is due."""
        self._ticks += 1
        if self._ticks % _EVERY_TICKS[self._flavour] == 0:
            message = self._of_px4() if self._flavour is Flavour.PX4 else self._of_ardupilot()
            with suppress(OSError):
                self._socket.sendto(self._encoder.encode(message), self._to)

    def _of_ardupilot(self) -> Message:
        b, (lat, lon) = self._body, self._globe.degrees(self._body.x, self._body.y)
        attitude, rates = (b.roll, -b.pitch, -b.yaw), self._rates()
        altitude = self._globe.altitude_mm(b.z) / 1000.0
        motion = (*quaternion_from_euler(b.roll, -b.pitch, -b.yaw), *attitude, b.ax, -b.ay, -b.az, *rates)
        place = (lat / 1e7, lon / 1e7, altitude, 0.0, 0.0, b.vx, -b.vy, -b.vz)
        return SimState(*motion, *place, lat_int=lat, lon_int=lon)

    def _of_px4(self) -> Message:
        b, place = self._body, (*self._globe.degrees(self._body.x, self._body.y), self._globe.altitude_mm(self._body.z))
        velocity = (round(100 * b.vx), round(-100 * b.vy), round(-100 * b.vz))
        attitude = quaternion_from_euler(b.roll, -b.pitch, -b.yaw)
        return HilStateQuaternion(self._ticks * 5000, attitude, *self._rates(), *place, *velocity, *(0,) * 5)

    def _rates(self) -> tuple[float, float, float]:
        wx, wy, wz = self._body.body_rates()
        return wx, -wy, -wz

    def close(self) -> None:
        """Close the socket."""
        self._socket.close()
