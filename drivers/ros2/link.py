"""One vehicle's topics and services at its router: its messages go to a function, its orders are sent here."""

import time
from collections.abc import Callable
from functools import partial

from drivers.rmw_zenoh.session import Caller, Publisher, RouterSession
from drivers.rmw_zenoh.wire import graph, vehicle
from drivers.rmw_zenoh.wire.cdr import WireError
from drivers.ros2 import names
from drivers.ros2.names import Order
from drivers.ros2.settings import Ros2Section

# key, payload, the publisher's 16 bytes
Hear = Callable[[str, bytes, bytes], None]


class Ros2Link:
    """Publishers, services and subscriptions of one vehicle; `node`: its own name in ROS 2, "" for none.

    refused: why the node refused the last of each order, "" if it did not; accepted: orders that it has answered since
    they were last sent.
    """

    def __init__(
        self, address: str, section: Ros2Section, node: str = "", hear: Hear = lambda key, payload, publisher: None
    ) -> None:
        self._section, self._node = section, node
        self._velocity: Publisher | None = None
        self._orders: dict[Order, Publisher | Caller] = {}
        self.refused: dict[Order, str] = {}
        self.accepted: set[Order] = set()
        heard = (names.odometry_key(section), names.battery_key(section)) if node else ()
        self._session = RouterSession(f"tcp/{address}:{section.port}", heard, hear, self._joined)

    def _joined(self, session: RouterSession) -> None:
        section = self._section
        kind = names.velocity_type(section)
        velocity = names.spoken_key(section, section.velocity, kind)
        if self._node:
            session.declare(graph.node_token(section.domain, session.zid, self._node))
            where = (section.domain, session.zid, self._node, 1, f"/{section.topic(section.velocity)}", kind)
            session.declare(graph.publisher_token(*where, velocity.rpartition("/")[2]))
            session.watch(graph.publishers_key(section.domain, section.topic(section.odometry), vehicle.ODOMETRY))
        self._velocity = session.publisher(velocity)
        for order in Order:
            key = names.order_key(section, order)
            if section.orders == "topics":
                self._orders[order] = session.publisher(key)
            else:
                self._orders[order] = session.caller(key, partial(self._answered, order))

    def _answered(self, order: Order, answer: bytes) -> None:
        try:
            success, words = vehicle.decode_answer(answer)
        except WireError:
            success, words = False, "its answer cannot be read"
        if success:
            self.accepted.add(order)
        self.refused[order] = "" if success else words or "it gives no reason"

    @property
    def trouble(self) -> str:
        """Return why messages do not reach the vehicle, or ""."""
        session, section = self._session, self._section
        if not session.reaches_router or self._velocity is None:
            return f"no ROS 2 Zenoh router answers at {session.endpoint}"
        if not self._velocity.is_heard:
            kind = names.velocity_type(section)
            return f"nobody in domain {section.domain} takes {kind} from /{section.topic(section.velocity)}"
        for order, end in self._orders.items():
            if not end.is_heard:
                what = "service" if section.orders == "services" else "topic"
                return f"nobody in domain {section.domain} has the {what} /{section.topic(getattr(section, order))}"
        return ""

    @property
    def odometry_nodes(self) -> tuple[str, ...]:
        """Return the names of the nodes that announce to publish its odometry."""
        return self._session.nodes

    def fly(self, velocity: vehicle.Vector3, turn_rad_s: float) -> bytes:
        """Send a velocity [m/s, rad/s; base_stabilized]; returns the bytes sent, empty while the router is away."""
        if self._velocity is None or not self._session.reaches_router:
            return b""
        payload = names.twist(self._section, velocity, turn_rad_s, time.time_ns())
        self._velocity.put(payload)
        return payload

    def order(self, order: Order) -> bytes:
        """Send an order; returns the bytes sent, empty while the router is away."""
        if order not in self._orders or not self._session.reaches_router:
            return b""
        self.accepted.discard(order)
        self._orders[order].put(vehicle.NOTHING)
        return vehicle.NOTHING

    def is_taken(self, order: Order) -> bool:
        """Return whether anybody receives an order."""
        return order in self._orders and self._orders[order].is_heard

    def close(self) -> None:
        """Leave the router; idempotent."""
        self._session.close()
