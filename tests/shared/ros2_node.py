"""A vehicle's ROS 2 node without a network, and the driver that hears it."""

import pytest

from drivers.rmw_zenoh.wire import vehicle
from drivers.ros2 import driver as ros2_driver
from drivers.ros2.driver import Ros2Vehicle
from drivers.ros2.settings import Ros2DriverSettings, Ros2Section
from drivers.watchdog_types import VehicleView
from groundstation.bus import clock
from groundstation.bus.memory_bus import MemoryBus, MemoryExchange
from groundstation.bus.topics import ODOMETRY

MS = 1_000_000
STANDING = vehicle.OdometryMessage(0, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0))


class FakeLink:
    """A router with a node that accepts everything."""

    trouble = ""

    def __init__(self, address: str, section: Ros2Section, node: str, hear: object) -> None:
        self.refused: dict[str, str] = {}
        self.accepted: set[str] = set()
        self.odometry_nodes: tuple[str, ...] = ("/drone_1/driver",)
        self.ordered: list[str] = []
        self.flown: list[vehicle.Vector3] = []

    def fly(self, velocity: vehicle.Vector3, turn_rad_s: float) -> bytes:
        self.flown.append(velocity)
        return b""

    def order(self, order: object) -> bytes:
        self.ordered.append(str(order))
        return vehicle.NOTHING

    def is_taken(self, order: object) -> bool:
        return True

    def close(self) -> None: ...


class Node:
    """A node that sends the given messages, and the driver that receives them, 20 times a second."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.now_ns = 1_000_000_000
        monkeypatch.setattr(ros2_driver, "Ros2Link", FakeLink)
        monkeypatch.setattr(clock, "now_ns", lambda: self.now_ns)
        exchange = MemoryExchange()
        self.heard = MemoryBus(exchange, "lab", "tracker").subscribe([ODOMETRY])
        settings = Ros2DriverSettings(
            name="drone_1", address="127.0.0.1", pad_m=(0.0, 0.0), ros2=Ros2Section(namespace="drone_1")
        )
        self.driver = Ros2Vehicle(settings, MemoryBus(exchange, "lab", "drone_1"))

    def say(
        self,
        message: vehicle.OdometryMessage,
        *,
        frame: str = "odom",
        own_frame: str = "base_link",
        publisher: bytes = b"publisher-of-it.",
        after_ms: int = 50,
    ) -> VehicleView:
        self.now_ns += after_ms * MS
        payload = vehicle.encode_odometry(message, frame, own_frame)
        self.driver._hear("0/drone_1/odom/nav_msgs::msg::dds_::Odometry_/RIHS01_x", payload, publisher)
        return self.driver.view(self.now_ns)

    @property
    def rejected(self) -> dict[str, int]:
        return self.driver.health(self.now_ns).rejected
