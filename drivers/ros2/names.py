"""Keys and types of the messages sent to the router, for driver and failsafe transport alike. Pure."""

from enum import StrEnum

from drivers.rmw_zenoh.wire import graph, vehicle
from drivers.ros2.settings import NO_HASH, Ros2Section

# The orders of the failsafe transport, which makes the messages itself.
HOVER, LAND = b"hover", b"land"


class Order(StrEnum):
    """The orders other than velocities; the values are keys of the section."""

    TAKE_OFF = "take_off"
    LAND = "land"
    CUT = "cut"


def velocity_type(section: Ros2Section) -> str:
    """Return the type of the topic that velocities are published under."""
    return vehicle.TWIST_STAMPED if section.velocity_type == "twist_stamped" else vehicle.TWIST


def spoken_key(section: Ros2Section, name: str, kind: str) -> str:
    """Return the key under which a message of a type with a known hash is published, or requested."""
    type_hash = NO_HASH if section.distro == "humble" else vehicle.HASHES[kind]
    return graph.topic_key(section.domain, section.topic(name), kind, type_hash)


def order_key(section: Ros2Section, order: Order) -> str:
    """Return the key of an order, as a topic's or a service's."""
    kind = vehicle.TRIGGER if section.orders == "services" else vehicle.EMPTY
    return spoken_key(section, str(getattr(section, order)), kind)


def odometry_key(section: Ros2Section) -> str:
    """Return the key expression of its odometry."""
    return graph.heard_key(section.domain, section.topic(section.odometry), vehicle.ODOMETRY)


def battery_key(section: Ros2Section) -> str:
    """Return the key expression of its charge."""
    return graph.heard_key(section.domain, section.topic(section.battery), vehicle.BATTERY)


def twist(section: Ros2Section, velocity: vehicle.Vector3, turn_rad_s: float, stamp_ns: int) -> bytes:
    """Return the message of a velocity; stamp_ns: Unix time, for a type that has one."""
    return vehicle.encode_twist(velocity, turn_rad_s, stamp_ns if section.velocity_type == "twist_stamped" else None)
