"""Programs by zenoh-ros2-sdk, a client of ROS 2 over Zenoh: `router`, `talker`, `listener`, `watcher`.

A router like rmw_zenoh's (gossip on) and two nodes that talk to each other; the listener prints each number that it
receives. The watcher lists the topics, decodes each, and prints its result as a line of JSON.
"""

import json
import os
import sys
import time
from typing import Any

from rosbags.typesys import Stores, get_typestore

PORT = 7447
_CHATTER, _STRING = "/chatter", "std_msgs/msg/String"
_LONGEST_S = 280.0
_TALK_S, _TURN_S, _SETTLED_S = 0.1, 0.2, 3.0
STORE = get_typestore(Stores.ROS2_JAZZY)


def router():
    import zenoh

    settings = {"mode": "router", "listen": {"endpoints": [f"tcp/[::]:{PORT}"]}}
    settings["scouting"] = {"multicast": {"enabled": False}, "gossip": {"enabled": True}}
    with zenoh.open(zenoh.Config.from_json5(json.dumps(settings))):
        print("ready", flush=True)
        time.sleep(_LONGEST_S)


def talker():
    from zenoh_ros2_sdk import ROS2Publisher

    definition, _ = STORE.generate_msgdef(_STRING, ros_version=2)
    publisher = ROS2Publisher(_CHATTER, _STRING, definition, node_name="talker", type_hash=STORE.hash_rihs01(_STRING))
    for number in range(int(_LONGEST_S / _TALK_S)):
        publisher.publish(data=str(number))
        time.sleep(_TALK_S)


def listener():
    subscribed(_CHATTER, _STRING, lambda message: print(message.data, flush=True))
    time.sleep(_LONGEST_S)


def subscribed(topic, kind, heard):
    """Subscribe with a type's definition from rosbags, which the SDK would fetch from the network."""
    from zenoh_ros2_sdk import ROS2Subscriber
    from zenoh_ros2_sdk.session import ZenohSession

    definition, _ = STORE.generate_msgdef(kind, ros_version=2)
    session = ZenohSession.get_instance("127.0.0.1", PORT)
    if kind in session.store.types:  # registered with another type, and cannot be registered again
        session._registered_types[kind] = kind
    return ROS2Subscriber(topic, kind, heard, definition, type_hash=STORE.hash_rihs01(kind))


def watcher(seconds, least):
    from zenoh_ros2_sdk.discovery import get_topic_names_and_types

    decoded: dict = {}
    subscriptions: dict = {}
    end_s, grew_s = time.monotonic() + float(seconds), time.monotonic()
    while time.monotonic() < end_s:
        for topic, kinds in get_topic_names_and_types(router_ip="127.0.0.1", router_port=PORT, domain_id=0):
            kind = kinds if isinstance(kinds, str) else kinds[0]
            if topic not in subscriptions:
                note = lambda message, topic=topic: decoded.setdefault(topic, type(message).__name__)  # noqa: E731
                subscriptions[topic], grew_s = (kind, subscribed(topic, kind, note)), time.monotonic()
                print(f"sees {topic}", flush=True)
        if len(decoded) == len(subscriptions) >= int(least) and time.monotonic() - grew_s > _SETTLED_S:
            break
        time.sleep(_TURN_S)
    listed = {topic: kind for topic, (kind, _) in subscriptions.items()}
    print(json.dumps({"listed": listed, "decoded": decoded}), flush=True)


if __name__ == "__main__":
    roles: dict[str, Any] = {"router": router, "talker": talker, "listener": listener, "watcher": watcher}
    roles[sys.argv[1]](*sys.argv[2:])
    os._exit(0)  # the SDK's threads would keep it
