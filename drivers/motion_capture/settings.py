"""Settings of one motion capture driver, as the composition hands them over (JSON of `MotionCaptureSection`)."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated, Literal
from urllib.parse import urlsplit

import numpy as np
from pydantic import Field

from drivers.motion_capture.wire.natnet import COMMAND_PORT
from drivers.rmw_zenoh.address import ROUTER_PORT, domain_of, topic_of
from drivers.vehicle_settings import DriverSection, Name, NotNegative, Positive
from groundstation import plug_ins
from groundstation.arrays import Array
from groundstation.geometry.rotations import rotation_x, rotation_z
from groundstation.vectors import Interval, Vector3


@dataclass(frozen=True, slots=True)
class PoseProtocol:
    """A protocol for poses: its usual port, its reader, and the parts that its address may have beside a host.

    reader: "module:class", made from a SystemAddress, a `drivers.motion_capture.sources.Source`; paths: a path and a
    query; any_port: another port than the usual one. answers_at: distance from the port of the address to the TCP port
    that is tried before the library connects, which would wait for an absent system for ever, with the whole process.
    """

    port: int
    reader: str
    paths: bool = False
    any_port: bool = True
    answers_at: int | None = None


_NATNET = "natnet"
_SOURCES = "drivers.motion_capture.sources"
# Those of other packages are entry points `skein.world_sensors`: the name is the scheme, the object the reader itself.
OURS: Mapping[str, PoseProtocol] = {
    _NATNET: PoseProtocol(COMMAND_PORT, f"{_SOURCES}:NatnetSource"),
    # The library takes another port for Qualisys only.
    "vicon": PoseProtocol(801, f"{_SOURCES}:LibrarySource", any_port=False, answers_at=0),
    "qualisys": PoseProtocol(22222, f"{_SOURCES}:LibrarySource", answers_at=1),
    "vrpn": PoseProtocol(3883, f"{_SOURCES}:LibrarySource", any_port=False),
    "ros2": PoseProtocol(ROUTER_PORT, "drivers.motion_capture.ros2_source:Ros2Source", paths=True),
}


@dataclass(frozen=True, slots=True)
class SystemAddress:
    """A system's address and protocol: scheme://host:port/path?query in parts.

    port: 0 where neither the address nor the protocol has one.
    """

    scheme: str
    host: str
    port: int
    path: str = ""
    query: str = ""

    @property
    def domain(self) -> int:
        """Return the domain of ROS 2; raises ValueError for any other query."""
        return domain_of(self.query)


def parse_source(text: str) -> SystemAddress:
    """Return the parts of a system's address; raises ValueError that names all forms."""
    scheme, _, rest = text.partition("://")
    others = [name for name in plug_ins.names(plug_ins.WORLD_SENSORS) if name not in OURS]
    if scheme not in (*OURS, *others) or not rest or any(character.isspace() for character in text):
        raise _unknown(others)
    parts = urlsplit(text)
    try:
        port = parts.port
    except ValueError:
        raise ValueError("the port is no number from 1 to 65535") from None
    path = parts.path.strip("/")
    if scheme not in OURS:
        return SystemAddress(scheme, parts.hostname or "", port or 0, path, parts.query)
    protocol = OURS[scheme]
    if port not in (None, protocol.port) and not protocol.any_port:
        raise ValueError(f"must have no port: {scheme}:// is heard at port {protocol.port} only")
    if not parts.hostname or ((path or parts.query) and not protocol.paths):
        raise ValueError(f"must name a host and nothing else, as in {scheme}://192.168.1.5")
    if protocol.paths:
        domain_of(parts.query)
        path = topic_of(parts.path)
    return SystemAddress(scheme, parts.hostname, port or protocol.port, path, parts.query)


def _unknown(others: Sequence[str]) -> ValueError:
    installed = "".join(f", {name}://" for name in others)
    return ValueError(
        "must be an address such as natnet://192.168.1.5 (OptiTrack), vicon://, qualisys:// or vrpn://192.168.1.5, "
        "or ros2://192.168.1.5/vrpn_mocap?domain=0 for topics /vrpn_mocap/<body>/pose behind a ROS 2 Zenoh router"
        f"{installed}{plug_ins.damage()}"
    )


def emulated_source(text: str, host: str, port: int) -> str:
    """Return the address of an emulated system: the same topics of ROS 2, or NatNet in place of any other protocol."""
    place, parts = f"{host}:{port}", urlsplit(text)
    return parts._replace(netloc=place).geturl() if parts.scheme == "ros2" else f"{_NATNET}://{place}"


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
    volume_m: where it sees bodies, along x, y, z [world]; observed: entities with observations for the tracker (the
    others are published as poses only); std: of a pose that it reports.
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
    volume_m: tuple[Interval, Interval, Interval]
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
