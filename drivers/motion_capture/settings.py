"""Settings of one motion capture driver, as the composition hands them over (JSON of `MotionCaptureSection`)."""

import math
from dataclasses import dataclass
from enum import StrEnum
from typing import Annotated, Literal
from urllib.parse import urlsplit

import numpy as np
from pydantic import Field

from drivers.vehicle_settings import DriverSection, Name, NotNegative, Positive
from groundstation.arrays import Array
from groundstation.geometry.rotations import rotation_x, rotation_z

Vector3 = tuple[float, float, float]
Span = tuple[float, float]


class SystemKind(StrEnum):
    """Which protocol poses come by: NatNet, topics of ROS 2, or others through the library `motioncapture`."""

    NATNET = "natnet"
    VICON = "vicon"
    QUALISYS = "qualisys"
    VRPN = "vrpn"
    ROS2 = "ros2"


# WIRE: DDS leaves ports for so many domains.
_LAST_DOMAIN = 232
_PORTS = {
    SystemKind.NATNET: 1510,
    SystemKind.VICON: 801,
    SystemKind.QUALISYS: 22222,
    SystemKind.VRPN: 3883,
    SystemKind.ROS2: 7447,
}


@dataclass(frozen=True, slots=True)
class SystemAddress:
    """Where a motion capture system listens, and what it speaks.

    path, domain: of ROS 2, the part of the topics before the body, and the domain.
    """

    kind: SystemKind
    host: str
    port: int
    path: str = ""
    domain: int = 0


def parse_source(text: str) -> SystemAddress:
    """Return what a system's address says; raises ValueError that names the forms there are."""
    kinds = {kind.value: kind for kind in SystemKind}
    scheme, mark, rest = text.partition("://")
    if not mark or scheme not in kinds or not rest or any(character.isspace() for character in text):
        raise ValueError(
            "must be an address such as natnet://192.168.1.5 (OptiTrack), vicon://, qualisys:// or vrpn://192.168.1.5, "
            "or ros2://192.168.1.5/vrpn_mocap?domain=0 for topics /vrpn_mocap/<body>/pose behind a ROS 2 Zenoh router"
        )
    parts = urlsplit(text)
    try:
        port = parts.port or _PORTS[kinds[scheme]]
    except ValueError:
        raise ValueError("the port is no number from 1 to 65535") from None
    if kinds[scheme] is SystemKind.ROS2 and parts.hostname:
        return SystemAddress(SystemKind.ROS2, parts.hostname, port, parts.path.strip("/"), _domain(parts.query))
    if not parts.hostname or parts.path.strip("/") or parts.query:
        raise ValueError(f"must name a host and nothing else, as in {scheme}://192.168.1.5")
    return SystemAddress(kinds[scheme], parts.hostname, port)


def _domain(query: str) -> int:
    name, _, value = (query or "domain=0").partition("=")
    if name != "domain" or not value.isdecimal() or int(value) > _LAST_DOMAIN:
        raise ValueError(f"behind ? there may be domain=0 to {_LAST_DOMAIN}, and nothing else")
    return int(value)


class BodySection(DriverSection):
    """One rigid body: the entity that carries it, its name in the system, its origin and x axis on the entity.

    position_m [base], yaw_deg: of the body's axes, on the entity; marker_m: the centre of the entity's marker [base].
    """

    entity: Name
    name: str
    position_m: Vector3 = (0.0, 0.0, 0.0)
    yaw_deg: float = 0.0
    marker_m: Vector3 = (0.0, 0.0, 0.0)


class MotionCaptureSection(DriverSection):
    """One system.

    position_m, yaw_deg: its origin and heading [world]; up: its vertical axis; delay_ms: from sending to arrival;
    volume_m: where it sees bodies, along x, y, z [world]; observed: entities that the tracker is told of (the others
    are published as poses only); std: of a pose that it reports.
    """

    name: Name
    source: str
    bodies: tuple[BodySection, ...]
    observed: tuple[Name, ...]
    up: Literal["y", "z"] = "z"
    position_m: Vector3 = (0.0, 0.0, 0.0)
    yaw_deg: float = 0.0
    delay_ms: NotNegative = 5.0
    rate_hz: Positive = 30.0
    position_std_m: Positive = 0.002
    heading_std_deg: Positive = 0.5
    volume_m: tuple[Span, Span, Span]
    max_speed_m_s: Positive = 5.0
    start_within_s: Annotated[float, Field(gt=0)] = 5.0
    silent_after_s: Annotated[float, Field(gt=0)] = 0.5

    def upright(self) -> Array:
        """Return the rotation (3, 3) that turns the system's up axis to z."""
        # WIRE (docs/reference/natnet.md 5): with y up, the system's x is ours and its z is our -y.
        return rotation_x(math.pi / 2) if self.up == "y" else np.eye(3)

    def world_from_system(self) -> tuple[Array, Array]:
        """Return rotation (3, 3) and translation (3) [m] from the system's axes to the world's."""
        return rotation_z(math.radians(self.yaw_deg)) @ self.upright(), np.array(self.position_m)

    def covariance(self) -> tuple[float, ...]:
        """Return the covariance (4, 4) of (position, heading), row-major."""
        place, heading = self.position_std_m**2, math.radians(self.heading_std_deg) ** 2
        return tuple(np.diag([place, place, place, heading]).ravel().tolist())
