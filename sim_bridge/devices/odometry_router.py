"""An emulated TurtleBot's node and its Zenoh router: nav_msgs/Odometry from its wheels, as rmw_zenoh publishes it.

Pose and heading are integrated from the wheels, in a frame of their own.
"""

import math
import time
from collections.abc import Iterable
from dataclasses import replace

from drivers.rmw_zenoh.wire import graph, vehicle
from sim_bridge.devices.ros2_router import ANY_HASH, PublishingRouter, topic_of
from sim_bridge.fault_kinds import Fault, FaultKind, standing
from sim_bridge.wheel_odometry import PERIOD_S, WheelOdometry
from sim_bridge.world.world import TICK_S

_EVERY = round(PERIOD_S / TICK_S)


class OdometryRouter(PublishingRouter):
    """Router and publisher of one base; `sim_bridge.world.emulation.Emulator`.

    source: topic and domain; faults: those of this target's odometry.
    """

    def __init__(
        self, name: str, place: tuple[str, int], source: str, wheels: WheelOdometry, faults: Iterable[Fault] = ()
    ) -> None:
        super().__init__(name, place)
        self._wheels, self._faults, self._ticks = wheels, tuple(faults), 0
        self._told: vehicle.OdometryMessage | None = None
        self._x = self._y = self._yaw = 0.0
        domain, topic = topic_of(source)
        key = graph.topic_key(domain, topic, vehicle.ODOMETRY, ANY_HASH)
        self._publisher = self.publisher(key)

    def send(self) -> None:
        """Publish what is due at this tick."""
        self._ticks += 1
        now_s = self._ticks * TICK_S
        if self.silent or self._ticks % _EVERY or standing(self._faults, FaultKind.ODOMETRY_SILENT, now_s):
            return
        if self._told is None or not standing(self._faults, FaultKind.ODOMETRY_FROZEN, now_s):
            self._told = self._measured(now_s)
        message = replace(self._told, stamp_ns=time.time_ns())
        self.publish(self._publisher, vehicle.encode_odometry(message, "odom", "base_footprint"))

    def _measured(self, now_s: float) -> vehicle.OdometryMessage:
        """Return the present message without a stamp."""
        speed, turn_rate = self._wheels.read()
        scaled = standing(self._faults, FaultKind.ODOMETRY_SCALED, now_s)
        speed *= scaled.amount if scaled else 1.0
        self._yaw = math.remainder(self._yaw + turn_rate * PERIOD_S, math.tau)
        self._x += speed * math.cos(self._yaw) * PERIOD_S
        self._y += speed * math.sin(self._yaw) * PERIOD_S
        turned = (0.0, 0.0, math.sin(self._yaw / 2), math.cos(self._yaw / 2))
        return vehicle.OdometryMessage(0, (self._x, self._y, 0.0), turned, (speed, 0.0, 0.0), (0.0, 0.0, turn_rate))
