"""A bridge to a ROS 2 Zenoh router: a client that publishes the flight's messages and reads nothing."""

import json
import os
import time
from collections.abc import Mapping
from typing import Any

import zenoh

from drivers.rmw_zenoh.wire import graph
from groundstation.bus import codec as bus_codec
from groundstation.bus import keys
from groundstation.bus.api import Bus, Sample, Subscription
from groundstation.bus.thinning import rates_by_key
from groundstation.bus.topics import ESTIMATE, EVENT, IMAGE, SETPOINT, TRUTH, VEHICLE_STATUS
from groundstation.engineering_views.ros2.advertised import advertised
from groundstation.engineering_views.ros2.codec import Ros2Codec, RosMessage
from groundstation.engineering_views.ros2.scene import STATES, Ros2Scene
from groundstation.errors import MessageError, OperatorMistake
from groundstation.field.resolved import ResolvedField
from groundstation.recording.timeline import Timeline
from groundstation.time_units import NS_PER_S

_STATIC_NS = NS_PER_S
_NODE = "skein"
_MOTION_HZ, _HEALTH_HZ = 12.5, 2.0


def enough_hz(site: str, field: ResolvedField | None) -> Mapping[str, float]:
    """Return the rates of samples that are enough [Hz], for keys that come more often.

    States of motion: a little above the rate of turns, else some turns would find none.
    """
    if field is None:
        return {}
    drones = tuple(field.drones)
    often = [
        (ESTIMATE, ("*",), _MOTION_HZ),
        (SETPOINT, drones, _MOTION_HZ),
        (TRUTH, (*drones, *field.tracked), _MOTION_HZ),
        (VEHICLE_STATUS, drones, _HEALTH_HZ),
    ]
    return rates_by_key(site, often)


class Ros2View:
    """Publishes until closed. It subscribes to nothing: no ROS 2 program can move a drone through it.

    truth: whether it shows true states, which only a simulator sends: they are a third of all messages.
    """

    PERIOD_S = 0.1

    def __init__(
        self,
        router: str,
        domain: int,
        distribution: str,
        field: ResolvedField | None,
        timeline: Timeline,
        truth: bool = False,
    ) -> None:
        self._codec, self._timeline, self._domain = Ros2Codec(distribution), timeline, domain
        self._scene = Ros2Scene(self._codec, field)
        self._states = tuple(topic for topic in STATES if truth or topic is not TRUTH)
        # A peer's messages would bypass the router, and scouting would find routers of others.
        settings = {
            "mode": "client",
            "connect": {"endpoints": [router], "timeout_ms": 3000, "exit_on_failure": True},
            "scouting": {"multicast": {"enabled": False}},
        }
        self._session: Any
        try:
            self._session = zenoh.open(zenoh.Config.from_json5(json.dumps(settings)))
        except zenoh.ZError as error:
            remedy = "start one (ros2 run rmw_zenoh_cpp rmw_zenohd), or name it with --router"
            raise OperatorMistake(f"{router}: no ROS 2 Zenoh router answers; {remedy}") from error
        self._zid = str(self._session.zid())
        node = graph.node_token(domain, self._zid, _NODE)
        self._tokens: list[Any] = [self._session.liveliness().declare_token(node)]
        # Before the first message of each: a tool lists a topic, and a subscriber waits for it, from the start.
        self._publishers = {topic: self._declare(topic, kind) for topic, kind in advertised(field, truth).items()}
        self._next_static_ns = 0

    @property
    def alive(self) -> bool:
        """Return whether it can still publish."""
        return not self._session.is_closed()

    def subscribe(self, bus: Bus) -> tuple[Subscription, ...]:
        """Return the queues of its topics: each turn takes the newest state and picture, and all events."""
        return bus.subscribe((*self._states, IMAGE), newest=True), bus.subscribe((EVENT,))

    def take(self, sample: Sample, now_ns: int) -> None:
        """Forward a sample that arrived at a boot-clock time; samples that cannot be decoded are ignored."""
        if now_ns >= self._next_static_ns:
            self._next_static_ns = now_ns + _STATIC_NS
            self._publish(self._scene.static(now_ns + self._timeline.unix_offset_ns))
        try:
            messages = self._messages(sample, now_ns)
        except MessageError:
            return
        for message in messages:
            self._publish(message)

    def _messages(self, sample: Sample, now_ns: int) -> list[RosMessage]:
        key = keys.parse(sample.key)
        if key.topic is IMAGE:
            header = bus_codec.decode_header(key, sample.attachment)
            stamp_ns, _ = self._timeline.times(header.stamp_ns, header.clock, now_ns)
            return self._scene.take_picture(stamp_ns, key.entity, sample.payload)
        message = bus_codec.decode(key, sample.payload)
        stamp_ns, _ = self._timeline.times(message.header.stamp_ns, message.header.clock, now_ns)
        return self._scene.take(stamp_ns, message)

    def _publish(self, message: RosMessage) -> None:
        publisher, identity, count = self._publishers.get(message.topic) or self._declare(message.topic, message.type)
        self._publishers[message.topic] = publisher, identity, count + 1
        publisher.put(message.data, attachment=graph.attachment(count + 1, time.time_ns(), identity))

    def _declare(self, topic: str, kind: str) -> tuple[Any, bytes, int]:
        type_hash = self._codec.hash_of(kind)
        key = graph.topic_key(self._domain, topic, kind, type_hash)
        publisher = self._session.declare_publisher(key, congestion_control=zenoh.CongestionControl.DROP)
        number = len(self._tokens)
        token = graph.publisher_token(self._domain, self._zid, _NODE, number, topic, kind, type_hash)
        self._tokens.append(self._session.liveliness().declare_token(token))
        return publisher, os.urandom(16), 0

    def close(self) -> None:
        """Leave the ROS 2 graph."""
        self._session.close()
