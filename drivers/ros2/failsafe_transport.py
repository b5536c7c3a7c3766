"""Lets supervisor and guardian stop and land a vehicle whose driver is dead, as clients of its router.

Their orders reach the vehicle only through its router and its node (docs/reference/ros2.md 4).
"""

import time
from collections.abc import Sequence

from drivers.ros2.link import Ros2Link
from drivers.ros2.names import HOVER, Order
from drivers.ros2.settings import Ros2DriverSettings

_PAUSE_S = 0.5


class Ros2Failsafe:
    """Sends HOVER and LAND; way: the driver's settings as JSON. It joins the router before it is needed."""

    def __init__(self, way: str, speaker: int) -> None:
        settings = Ros2DriverSettings.model_validate_json(way)
        self._link = Ros2Link(settings.address, settings.ros2)
        self._landed_s = float("-inf")

    def send(self, datagram: bytes, addresses: Sequence[tuple[str, int]]) -> None:
        """Send HOVER (zero velocity) or LAND (at most twice a second); raises OSError without a router."""
        if datagram == HOVER:
            said = self._link.fly((0.0, 0.0, 0.0), 0.0)
        elif time.monotonic() - self._landed_s < _PAUSE_S:
            return
        else:
            said, self._landed_s = self._link.order(Order.LAND), time.monotonic()
        if not said:
            raise OSError("no ROS 2 Zenoh router answers")

    def close(self) -> None:
        """Leave the router; idempotent."""
        self._link.close()
