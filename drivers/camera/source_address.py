"""The address of a source of pictures, taken apart: network cameras, topics, vehicles, devices, files, plug-ins."""

from dataclasses import dataclass, field
from enum import StrEnum
from urllib.parse import SplitResult, unquote, urlsplit

from drivers.rmw_zenoh.address import ROUTER_PORT, domain_of, topic_of
from groundstation import plug_ins
from groundstation.adapters import split_zone, with_zone
from groundstation.vehicles import VehicleKind, all_kinds


class SourceKind(StrEnum):
    """Kinds of sources of pictures."""

    HTTP = "http"
    RTSP = "rtsp"
    ROS2 = "ros2"
    DEVICE = "device"
    FILE = "file"
    VEHICLE = "vehicle"
    PLUG_IN = "plug-in"


_PORTS = {SourceKind.HTTP: 80, SourceKind.RTSP: 554, SourceKind.ROS2: ROUTER_PORT}
# Libraries open these, through any adapter.
_ANY_ADAPTER = frozenset({SourceKind.RTSP, SourceKind.ROS2})


@dataclass(frozen=True, slots=True)
class SourceAddress:
    """The parsed address of a source.

    path: of the stream with its query, of the topic, of the device, of the file or folder; host: of a plug-in, its
    scheme; login: "user:password", or "" for none; interface: the network adapter that it is behind, or "" for any;
    domain: of ROS 2; vehicle: for a vehicle's own video, the scheme of its kind.
    """

    kind: SourceKind
    host: str = ""
    port: int = 0
    path: str = ""
    login: str = field(default="", repr=False)
    interface: str = ""
    domain: int = 0
    vehicle: str = ""


def parse_source(text: str) -> SourceAddress:
    """Return the parts of a source's address; raises ValueError that names all forms."""
    if text.startswith("/dev/"):
        return SourceAddress(SourceKind.DEVICE, path=text)
    if text.startswith(("/", "file:///")):
        return SourceAddress(SourceKind.FILE, path=text.removeprefix("file://"))
    scheme, _, rest = text.partition("://")
    if not rest or any(character.isspace() for character in text):
        raise _unknown()
    if scheme in _PORTS:
        return _stream(SourceKind(scheme), urlsplit(text))
    if scheme in plug_ins.names(plug_ins.CAMERAS):
        return SourceAddress(SourceKind.PLUG_IN, host=scheme, path=rest)
    if (vehicle := _with_video().get(scheme)) is None:
        raise _unknown()
    host, port, interface = _place(urlsplit(text), vehicle.camera_port)
    return SourceAddress(SourceKind.VEHICLE, host, port, interface=interface, vehicle=scheme)


def behind_adapter(text: str, interface: str) -> str:
    """Return a source's address with the network adapter that it is reached through, where it names none itself."""
    parts = urlsplit(text)
    login, at, place = parts.netloc.rpartition("@")
    host, colon, port = place.partition(":")
    return parts._replace(netloc=f"{login}{at}{with_zone(host, interface)}{colon}{port}").geturl()


def _with_video() -> dict[str, VehicleKind]:
    """Return the kinds of vehicles with a video of their own, by the scheme of its address."""
    return {kind.camera: kind for kind in all_kinds().values() if kind.reader and kind.camera not in _PORTS}


def _unknown() -> ValueError:
    own = "".join(f"{scheme}://192.168.1.1, " for scheme in _with_video())
    return ValueError(
        f"must be an address such as http://192.168.1.50:8080/video.mjpg, {own}"
        "rtsp://192.168.1.60/stream, ros2://192.168.1.20/camera/image/compressed, /dev/video0 or /a/video.mp4"
        f"{plug_ins.damage()}"
    )


def _stream(kind: SourceKind, parts: SplitResult) -> SourceAddress:
    host, port, interface = _place(parts, _PORTS[kind])
    if interface and kind in _ANY_ADAPTER:
        raise ValueError(f"cannot be behind an adapter (%{interface}): the library that opens {kind}:// takes any")
    if kind is SourceKind.ROS2:
        return SourceAddress(kind, host, port, _topic(parts), domain=domain_of(parts.query))
    path = (parts.path or "/") + (f"?{parts.query}" if parts.query else "")
    return SourceAddress(kind, host, port, path, _login(parts), interface)


def _place(parts: SplitResult, usual_port: int) -> tuple[str, int, str]:
    """Return host, port and network adapter."""
    try:
        port = parts.port or usual_port
    except ValueError:
        escape = " (a / in a password is written %2F)" if "@" in parts.netloc + parts.path else ""
        raise ValueError(f"the port is no number from 1 to 65535{escape}") from None
    if not parts.hostname:
        raise ValueError(f"must name a host, as in {parts.scheme}://192.168.1.50")
    host, interface = split_zone(parts.hostname)
    return host, port, interface


def _topic(parts: SplitResult) -> str:
    if not (topic := topic_of(parts.path)):
        raise ValueError("must name a topic, as in ros2://192.168.1.20/camera/image/compressed")
    return topic


def _login(parts: SplitResult) -> str:
    return "" if parts.username is None else f"{unquote(parts.username)}:{unquote(parts.password or '')}"
