"""Checks of vehicles and the network adapters that lead to them."""

from collections.abc import Iterator, Mapping
from itertools import combinations
from urllib.parse import urlsplit

from drivers.camera.source_address import SourceKind, parse_source
from groundstation.settings.document import KeyPath
from groundstation.settings.drones import Drone
from groundstation.vehicles import kind_named


def findings_of_adapters(drones: Mapping[str, Drone]) -> Iterator[tuple[KeyPath, str]]:
    """Return vehicles that cannot be distinguished, and videos that would not come through their vehicle's adapter."""
    for (first, one), (second, other) in combinations(drones.items(), 2):
        apart = one.interface and other.interface and one.interface != other.interface
        together = one.kind == other.kind and kind_named(one.kind).shares_address
        if one.address == other.address and one.host == other.host and not (apart or together):
            text = f"address {one.address} is already that of {first}; behind an adapter each, both need an interface"
            yield ("drones", second, "address"), text
    for name, drone in drones.items():
        if drone.interface:
            yield from _video(name, drone)


def _video(name: str, drone: Drone) -> Iterator[tuple[KeyPath, str]]:
    source, path = parse_source(drone.camera.source), ("drones", name, "camera", "source")
    if source.host == drone.address and source.interface not in ("", drone.interface):
        yield path, f"must come through the vehicle's interface {drone.interface} (got {source.interface})"
    # A library or a plug-in opens the connection, and may use another adapter: pictures of another vehicle.
    opened_elsewhere = source.kind in (SourceKind.RTSP, SourceKind.ROS2, SourceKind.PLUG_IN)
    if opened_elsewhere and urlsplit(drone.camera.source).hostname == drone.address:
        scheme = drone.camera.source.partition(":")[0]
        remedy = f"; a plug-in that chooses one takes %{drone.interface} after the address"
        hint = remedy if source.kind is SourceKind.PLUG_IN else ""
        yield path, f"cannot be used with interface: what opens {scheme}:// chooses no adapter{hint}"
