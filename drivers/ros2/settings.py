"""Settings of a vehicle behind a ROS 2 node: its section of the field file, and its driver's section."""

from typing import Annotated, Literal

from pydantic import Field

from drivers.rmw_zenoh.address import LAST_DOMAIN, NAME, ROUTER_PORT
from drivers.vehicle_settings import Shape, VehicleDriverSettings
from groundstation.vehicles import KindSection

# The type hash of Humble, which has none.
NO_HASH = "TypeHashNotSupported"
# Faster than any flight of this kind [m/s]: beyond it a reported velocity is no measurement.
FASTEST_M_S = 8.0

_WORDS = "must be a name of ROS 2 such as drone_1/odom (parts of letters, digits and _, no digit first)"
TopicName = Annotated[str, Shape(f"^/?{NAME}$", _WORDS)]


class Ros2Section(KindSection):
    """A vehicle behind a ROS 2 node; the drone's address is that of the Zenoh router, which several may share.

    Names without a leading slash are in the namespace.
    """

    port: Annotated[int, Field(ge=1, le=65535)] = ROUTER_PORT
    """TCP port of the router."""
    domain: Annotated[int, Field(ge=0, le=LAST_DOMAIN)] = 0
    """ROS_DOMAIN_ID of the node."""
    distro: Literal["humble", "jazzy", "lyrical"] = "jazzy"
    """Distribution of the node; those between have jazzy's keys."""
    namespace: Annotated[str, Shape(f"^({NAME})?$", f"{_WORDS}, without a leading slash")] = ""
    """Namespace of the node's topics and services, such as drone_1; empty: none."""
    odometry: TopicName = "odom"
    """Topic of its nav_msgs/Odometry: velocity in the vehicle's own frame, attitude, height; at 10 Hz at least."""
    battery: TopicName = "battery"
    """Topic of its sensor_msgs/BatteryState; a vehicle whose charge is unknown does not take off."""
    velocity: TopicName = "cmd_vel"
    """Topic that it takes velocities from, along its own axes."""
    velocity_type: Literal["twist", "twist_stamped"] = "twist"
    """Type of that topic: geometry_msgs/Twist or TwistStamped."""
    orders: Literal["topics", "services"] = "topics"
    """Whether take_off, land and cut are topics (std_msgs/Empty) or services (std_srvs/Trigger)."""
    take_off: TopicName = "takeoff"
    """Order to take off and hover at take_off_m."""
    land: TopicName = "land"
    """Order to land and stop the motors."""
    cut: TopicName = "reset"
    """Order that stops the motors at once, also in the air."""
    take_off_m: Annotated[float, Field(ge=0.4, le=3)] = 0.8
    """Height [m] that its own take-off climbs to."""
    standing_z_m: Annotated[float, Field(ge=-100, le=100)] = 0.0
    """z [m] of its odometry while it stands on the floor."""

    def topic(self, name: str) -> str:
        """Return the absolute name, without its leading slash, of a topic or service."""
        return name.strip("/") if name.startswith("/") or not self.namespace else f"{self.namespace}/{name}"


class Ros2DriverSettings(VehicleDriverSettings):
    """One vehicle behind a ROS 2 node."""

    ros2: Ros2Section = Ros2Section()
