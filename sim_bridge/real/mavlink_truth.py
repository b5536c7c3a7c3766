"""Receives the true pose of a vehicle over MAVLink from the simulator behind its firmware.

SIM_STATE (ArduPilot, asked for) and HIL_STATE_QUATERNION (PX4's SIH) are exact; until one of them arrives,
LOCAL_POSITION_NED with ATTITUDE counts, which any vehicle with a position sends, PX4's SIH even before it
has been placed on its globe. The vehicle does not move when its source changes. The latter are the autopilot's own
estimate: cameras that see its body there confirm its errors, which `caveat` says.
"""

import math
from contextlib import suppress

from drivers.mavlink.wire.errors import WireError
from drivers.mavlink.wire.flight import command_to
from drivers.mavlink.wire.frames import MAX_DATAGRAM, FrameDecoder, FrameEncoder, Message, id_of, split
from drivers.mavlink.wire.names import MavCmd
from drivers.mavlink.wire.simulator import HilStateQuaternion, SimState
from drivers.mavlink.wire.telemetry import Attitude, LocalPositionNed
from groundstation.geometry.angles import euler_from_quaternion
from groundstation.time_units import NS_PER_S
from groundstation.vectors import Vector3
from sim_bridge.devices.mavlink_identity import identity_of
from sim_bridge.listening import open_udp
from sim_bridge.real.placed import Placement, TrueState
from sim_bridge.site import SiteDrone
from sim_bridge.world.puppet import OutsidePose

Address = tuple[str, int]
# The id of a system that is neither vehicle nor ground station: no failsafe of a vehicle depends on it.
_SYSTEM, _COMPONENT = 254, 191
_ASK_NS, _INTERVAL_US = 2 * NS_PER_S, 20_000.0
# Each simulator has a globe of its own [m per degree]: 0.1 % apart.
_ARDUPILOT_DEGREE_M, _PX4_DEGREE_M = 111_318.845, 111_194.927
# WIRE (SIM_STATE, HIL_STATE_QUATERNION): latitude and longitude are whole 1e-7 degrees, a centimetre and more.
_GRAIN_M = 1e-7 * _ARDUPILOT_DEGREE_M
_DATAGRAMS = 64


class AutopilotTruth:
    """Listens at an address; `latest` empties the port and returns the newest pose in the room."""

    def __init__(self, name: str, address: Address, system: int, placement: Placement) -> None:
        self._system, self._placement = system, placement
        self._encoder, self._decoder = FrameEncoder(_SYSTEM, _COMPONENT), FrameDecoder()
        self._attitude: Attitude | None = None
        self._exact = False
        self._origin: tuple[float, float] | None = None
        self._asked_ns = -_ASK_NS
        self.rejected = 0
        self._socket = open_udp(f"the true pose of {name}", *address)

    def latest(self, now_ns: int) -> OutsidePose | None:
        """Return the vehicle's pose, None without a new one; now_ns: of any steady clock."""
        newest: TrueState | None = None
        for _ in range(_DATAGRAMS):
            try:
                data, source = self._socket.recvfrom(MAX_DATAGRAM)
            except OSError:
                break
            newest = self.take(data) or newest
            self._ask(source, now_ns)
        return None if newest is None else self._placement.pose(newest)

    @property
    def caveat(self) -> str:
        """Return why the poses are not exact, or ""."""
        return "" if self._exact else "its pose is its own estimate: cameras confirm its errors"

    def take(self, data: bytes) -> TrueState | None:
        """Return the newest true state in a datagram; other bytes and frames of other vehicles are counted."""
        newest: TrueState | None = None
        try:
            for raw in split(data):
                frame = self._decoder.decode(raw)
                if frame.system != self._system:
                    self.rejected += 1
                elif frame.message is not None:
                    newest = self._state(frame.message) or newest
        except WireError:
            self.rejected += 1
        return newest if newest is None or _is_finite(newest) else None

    def _state(self, message: Message) -> TrueState | None:
        match message:
            case SimState():
                return self._exactly(self._of_ardupilot(message))
            case HilStateQuaternion():
                return self._exactly(self._of_px4(message))
            case Attitude():
                self._attitude = message
            case LocalPositionNed() if self._attitude is not None and not self._exact:
                a, m = self._attitude, message
                rates = (a.rollspeed, a.pitchspeed, a.yawspeed)
                return TrueState((m.x, m.y, m.z), (m.vx, m.vy, m.vz), (a.roll, a.pitch, a.yaw), rates)
        return None

    def _exactly(self, state: TrueState) -> TrueState:
        if not self._exact and _is_finite(state):
            self._exact = True
            self._placement.go_on_from(state)
        return state

    def _ask(self, source: Address, now_ns: int) -> None:
        if now_ns - self._asked_ns < _ASK_NS:
            return
        self._asked_ns = now_ns
        kinds = (SimState,) if self._exact else (SimState, Attitude, LocalPositionNed)
        for kind in kinds:
            number = float(id_of(kind))
            more = (number, _INTERVAL_US, 0.0, 0.0, 0.0, 0.0, 0.0)
            command = command_to(self._system, MavCmd.SET_MESSAGE_INTERVAL, *more)
            with suppress(OSError):
                self._socket.sendto(self._encoder.encode(command), source)

    def _of_ardupilot(self, m: SimState) -> TrueState:
        degrees = (m.lat_int / 1e7, m.lon_int / 1e7) if m.lat_int or m.lon_int else (m.lat, m.lon)
        place = self._local(*degrees, m.alt, _ARDUPILOT_DEGREE_M)
        attitude, rates = (m.roll, m.pitch, m.yaw), (m.xgyro, m.ygyro, m.zgyro)
        return TrueState(place, (m.vn, m.ve, m.vd), attitude, rates, _GRAIN_M)

    def _of_px4(self, m: HilStateQuaternion) -> TrueState:
        w, x, y, z = m.attitude_quaternion
        place = self._local(m.lat / 1e7, m.lon / 1e7, m.alt / 1e3, _PX4_DEGREE_M)
        rates = (m.rollspeed, m.pitchspeed, m.yawspeed)
        velocity = (m.vx / 100.0, m.vy / 100.0, m.vz / 100.0)
        return TrueState(place, velocity, euler_from_quaternion((w, x, y, z)), rates, _GRAIN_M)

    def _local(self, latitude: float, longitude: float, altitude: float, degree_m: float) -> Vector3:
        first = self._origin = self._origin or (latitude, longitude)
        east = (longitude - first[1]) * degree_m * math.cos(math.radians(first[0]))
        return (latitude - first[0]) * degree_m, east, -altitude

    def close(self) -> None:
        """Close the port."""
        self._socket.close()


def of_drone(name: str, address: Address, drone: SiteDrone) -> AutopilotTruth:
    """Return the receiver of a field drone's true pose at an address."""
    return AutopilotTruth(name, address, identity_of(drone).system_id, Placement(drone.pad_m, drone.pad_yaw_rad))


def _is_finite(state: TrueState) -> bool:
    return all(math.isfinite(v) for part in (state.position, state.velocity, state.attitude, state.rates) for v in part)
