"""Settings of the driver of one target's odometry, as the composition hands them over."""

from dataclasses import dataclass
from typing import Annotated
from urllib.parse import urlsplit

from pydantic import Field

from drivers.rmw_zenoh.address import ROUTER_PORT, domain_of, topic_of
from drivers.vehicle_settings import DriverSection, Name, NotNegative, Positive

_SCHEME = "ros2"


@dataclass(frozen=True, slots=True)
class OdometryAddress:
    """Router, domain and topic of an odometry."""

    host: str
    port: int
    topic: str
    domain: int


def parse_source(text: str) -> OdometryAddress:
    """Return the parts of an odometry's address; raises ValueError that shows the form."""
    wrong = ValueError("must be a topic behind a ROS 2 Zenoh router, as in ros2://192.168.1.20/odom?domain=0")
    parts = urlsplit(text)
    try:
        host, port = parts.hostname or "", parts.port or ROUTER_PORT
    except ValueError:
        raise wrong from None
    more = parts.fragment or parts.username is not None
    if parts.scheme != _SCHEME or not host or more or any(character.isspace() for character in text):
        raise wrong
    if not (topic := topic_of(parts.path)):
        raise wrong
    return OdometryAddress(host, port, topic, domain_of(parts.query))


def emulated_source(text: str, host: str, port: int) -> str:
    """Return the address of the same topic behind an emulated router."""
    return urlsplit(text)._replace(netloc=f"{host}:{port}").geturl()


class OdometrySection(DriverSection):
    """One target's odometry.

    name: of the stream; target: its name; delay_ms: from the measurement to the arrival; max_speed_m_s: a speed that
    the target cannot exceed.
    """

    name: Name
    target: Name
    source: str
    speed_std_m_s: Positive = 0.05
    max_speed_m_s: Positive
    delay_ms: NotNegative = 20.0
    start_within_s: Annotated[float, Field(gt=0)] = 5.0
    silent_after_s: Annotated[float, Field(gt=0)] = 1.0
