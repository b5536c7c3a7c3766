"""Checks of devices that another host runs."""

from collections.abc import Iterator, Mapping
from typing import Protocol

from groundstation.errors import without_password
from groundstation.settings.behaviour import Bus
from groundstation.settings.document import KeyPath
from groundstation.settings.drones import Drone
from groundstation.settings.room import WorldCameraSettings
from groundstation.settings.values import HostName


class OnHost(Protocol):
    """A device that another host may run."""

    @property
    def host(self) -> HostName:
        """The name of that host, "" for the run's own."""


def findings_of_hosts(
    drones: Mapping[str, Drone],
    cameras: Mapping[str, WorldCameraSettings],
    systems: Mapping[str, Mapping[str, OnHost]],
    bus: Bus | None,
) -> Iterator[tuple[KeyPath, str]]:
    """Return hosts that cannot reach the run, have a device's name, or would need a password that stays here."""
    hosts: dict[KeyPath, str] = {("drones", name, "host"): drone.host for name, drone in drones.items()}
    hosts |= {("cameras", name, "host"): camera.host for name, camera in cameras.items()}
    hosts |= {(kind, name, "host"): one.host for kind, own in systems.items() for name, one in own.items()}
    sources: dict[KeyPath, tuple[str, str]] = {
        ("drones", name, "camera", "source"): (one.host, one.camera.source) for name, one in drones.items()
    }
    sources |= {("cameras", name, "source"): (one.host, one.source) for name, one in cameras.items()}
    named = {*drones, *cameras, *(name for own in systems.values() for name in own)}
    for path, host in hosts.items():
        if host in named:
            yield path, f"must not be called as a device of the field (got {host})"
        elif host and bus is not None and not bus.listen:
            yield path, f"needs bus.listen: the address of this computer at which {host} reaches the run"
    for place, (host, source) in sources.items():
        if host and without_password(source) != source:
            yield place, f"cannot be used on {host} with a password: passwords do not leave this computer"
