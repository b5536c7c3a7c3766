"""A Zenoh router as ROS 2 has it, and the node of an emulated device that shares its process."""

import json
import os
import time
from typing import Any
from urllib.parse import parse_qs, urlsplit

import zenoh

from drivers.rmw_zenoh.wire import graph
from groundstation.errors import GroundStationError

ANY_HASH = "RIHS01_" + "0" * 64
"""A type's hash, where readers ask for any."""


def topic_of(source: str) -> tuple[int, str]:
    """Return domain and topic of an address ros2://HOST/TOPIC?domain=N."""
    parts = urlsplit(source)
    return int(parse_qs(parts.query).get("domain", ["0"])[0]), parts.path.strip("/")


class Ros2Router:
    """Listens on an endpoint; `session` is the node's own. Raises GroundStationError where it cannot listen."""

    def __init__(self, name: str, endpoint: str) -> None:
        settings = {"mode": "router", "listen": {"endpoints": [endpoint], "exit_on_failure": True},
                    "scouting": {"multicast": {"enabled": False}}}  # fmt: skip
        self._identity, self._said = os.urandom(16), 0
        try:
            self.session: Any = zenoh.open(zenoh.Config.from_json5(json.dumps(settings)))
        except zenoh.ZError as error:
            raise GroundStationError(f"emulated {name}: cannot listen on {endpoint}: {error}") from error

    def publisher(self, key: str) -> Any:
        """Return a publisher that drops rather than waits."""
        return self.session.declare_publisher(key, congestion_control=zenoh.CongestionControl.DROP)

    def publish(self, publisher: Any, payload: bytes) -> None:
        """Publish a message with its number, time and publisher."""
        self._said += 1
        publisher.put(payload, attachment=graph.attachment(self._said, time.time_ns(), self._identity))

    def close(self) -> None:
        """End node and router."""
        self.session.close()


class PublishingRouter(Ros2Router):
    """A router whose node only publishes; `sim_bridge.world.emulation.Emulator`, but for `send`."""

    def __init__(self, name: str, place: tuple[str, int]) -> None:
        super().__init__(name, f"tcp/{place[0]}:{place[1]}")
        self.silent = self.deaf = False
        self._bell = os.eventfd(0, os.EFD_NONBLOCK)

    def fileno(self) -> int:
        """Return a descriptor that never becomes readable."""
        return self._bell

    def receive(self) -> None:
        """Ignore input: the node only publishes."""

    def close(self) -> None:
        """End node and router."""
        super().close()
        os.close(self._bell)
