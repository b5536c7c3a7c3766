"""Settings of one ranging driver, as the composition hands them over (JSON of `RangingSection`)."""

from typing import Annotated
from urllib.parse import urlsplit

from pydantic import Field

from drivers.vehicle_settings import DriverSection, Name, NotNegative, Positive
from groundstation.vectors import Interval, Vector3

# WIRE (docs/reference/ranges.md 1): ours, registered nowhere.
_USUAL_PORT = 7417
_SCHEME = "ranges"


def parse_source(text: str) -> tuple[str, int]:
    """Return host and port of a gateway; raises ValueError that shows the form."""
    parts = urlsplit(text)
    wrong = ValueError("must be the address of a gateway and nothing else, as in ranges://192.168.1.6:7417")
    try:
        host, port = parts.hostname or "", parts.port or _USUAL_PORT
    except ValueError:
        raise wrong from None
    more = parts.path.strip("/") or parts.query or parts.fragment or parts.username is not None
    if parts.scheme != _SCHEME or not host or more or any(character.isspace() for character in text):
        raise wrong
    return host, port


def emulated_source(host: str, port: int) -> str:
    """Return the address of an emulated gateway."""
    return f"{_SCHEME}://{host}:{port}"


class TransponderSection(DriverSection):
    """One transponder: the robot that carries it, and its name in the system."""

    entity: Name
    name: str


class RangingSection(DriverSection):
    """One system.

    anchors: their places [m; world]; volume_m: where robots are likely, along x, y, z [world]; range_std_m, bias_std_m:
    of one range, and of its lasting error; delay_ms: from the measurement to the arrival.
    """

    name: Name
    source: str
    anchors: dict[str, Vector3]
    transponders: tuple[TransponderSection, ...]
    volume_m: tuple[Interval, Interval, Interval]
    delay_ms: NotNegative = 20.0
    range_std_m: Positive = 0.08
    bias_std_m: Positive = 0.05
    reach_m: Positive = 30.0
    start_within_s: Annotated[float, Field(gt=0)] = 5.0
    silent_after_s: Annotated[float, Field(gt=0)] = 1.0
