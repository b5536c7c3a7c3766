"""A satellite receiver of an emulated vehicle: the room's place on Earth, and the fixes that its filter gets.

Written from docs/reference/mavlink.md 1: with GPS ArduCopter's filter is wrong by 3 cm on average.
"""

import math

import numpy as np

from sim_bridge.devices.mavlink_places import DEGREE_M
from sim_bridge.world.airframe import STANDING_HEIGHT_M
from sim_bridge.world.mavlink_copter import MavlinkCopter

_NOISE_M = 0.02
_EVERY_TICKS = 20  # 10 Hz


class Satellites:
    """The room's origin at (latitude, longitude) [deg] and altitude [m]; local x is north."""

    def __init__(self, seed: int, latitude: float = 47.397742, longitude: float = 8.545594, altitude: float = 488.0):
        self._random = np.random.default_rng(seed)
        self._latitude, self._longitude, self._altitude = latitude, longitude, altitude
        self._shrink = math.cos(math.radians(latitude))
        self._ticks = 0

    def aid(self, copter: MavlinkCopter) -> None:
        """Give the vehicle's filter a fix when one is due; call it once per tick."""
        self._ticks += 1
        if self._ticks % _EVERY_TICKS == 0:
            body = copter.airframe
            x, y, z = self._random.normal((body.x, body.y, body.z), _NOISE_M).tolist()
            copter.estimate.aid((x, y, z), body.yaw, 0)

    def degrees(self, x: float, y: float) -> tuple[int, int]:
        """Return latitude and longitude [deg x 1e7] of a place [m; x north, y west]."""
        latitude = self._latitude + x / DEGREE_M
        return round(latitude * 1e7), round((self._longitude - y / (DEGREE_M * self._shrink)) * 1e7)

    def altitude_mm(self, z: float) -> int:
        """Return the altitude of a height above the floor [m]."""
        return round((self._altitude + z - STANDING_HEIGHT_M) * 1000)

    def height_of(self, altitude_m: float) -> float:
        """Return the height above the floor of an altitude [m]."""
        return altitude_m - self._altitude + STANDING_HEIGHT_M

    @property
    def origin(self) -> tuple[int, int, int]:
        """Return the room's place on Earth [deg x 1e7, mm]."""
        return (*self.degrees(0.0, 0.0), self.altitude_mm(STANDING_HEIGHT_M))
