"""Moves the puppets of a world with the real bodies, and reports when their places are unknown."""

from collections.abc import Mapping
from pkgutil import resolve_name
from typing import Protocol

from groundstation.bus.api import Bus
from groundstation.bus.messages import Estimate
from groundstation.bus.topics import ESTIMATE
from groundstation.vehicles import kind_named
from sim_bridge.launch_spec import PoseSource, RealBody
from sim_bridge.real.captured import CaptureFeed
from sim_bridge.site import Site
from sim_bridge.world.puppet import OutsidePose, Puppet


class PoseFeed(Protocol):
    """A source of poses of one real body."""

    def latest(self, now_ns: int) -> OutsidePose | None:
        """Return the newest pose, None if nothing new arrived."""

    def close(self) -> None:
        """Release its resources."""


class EstimateFeed:
    """The tracker's estimate of one robot; emulated cameras cannot correct it, for they do not show the robot."""

    def __init__(self, name: str, bus: Bus) -> None:
        self._name = name
        self._inbox = bus.subscribe([ESTIMATE])

    def latest(self, now_ns: int) -> OutsidePose | None:
        """Return the newest estimate, level, since its tilt is not estimated."""
        pose = None
        for received in self._inbox.drain():
            if isinstance(received.message, Estimate):
                pose = _pose_in(received.message, self._name) or pose
        return pose

    def close(self) -> None:
        """Do nothing: the bus ends its subscriptions."""


def _pose_in(estimate: Estimate, name: str) -> OutsidePose | None:
    for one in estimate.entities:
        if one.name == name and len(one.mean) == 4:
            x, y, z, yaw = one.mean
            vx, vy, vz = one.velocity_m_s
            return OutsidePose((x, y, z), (vx, vy, vz), (0.0, 0.0, yaw))
    return None


class Followers:
    """One feed for each puppet; `close` releases them."""

    def __init__(self, site: Site, real: Mapping[str, RealBody], puppets: Mapping[str, Puppet], bus: Bus) -> None:
        self._puppets = puppets
        self._feeds: dict[str, PoseFeed] = {}
        self._said: dict[str, str | None] = dict.fromkeys(puppets)
        try:
            for name in puppets:
                self._feeds[name] = _feed(name, real[name], site, bus)
        except Exception:
            self.close()
            raise

    def move(self, now_ns: int) -> None:
        """Move each puppet to its real body's pose."""
        for name, feed in self._feeds.items():
            pose = feed.latest(now_ns)
            if pose is not None:
                self._puppets[name].follow(pose)

    def news(self) -> list[tuple[str, str]]:
        """Return (name, line) for each body that got lost, or is known again, since the last call."""
        lines = []
        for name, puppet in self._puppets.items():
            why = puppet.nowhere
            if why != self._said[name]:
                self._said[name] = why
                line = f"{why}: emulated cameras neither show it nor send its pictures" if why else "is followed"
                lines.append((name, line))
        return lines

    def close(self) -> None:
        """Release all feeds."""
        for feed in self._feeds.values():
            feed.close()


def _feed(name: str, body: RealBody, site: Site, bus: Bus) -> PoseFeed:
    drone = site.drones[name]
    if body.source is PoseSource.AUTOPILOT and body.address is not None:
        feed: PoseFeed = resolve_name(kind_named(drone.kind).true_pose)(name, body.address, drone)
        return feed
    if body.source is PoseSource.CAPTURE:
        return CaptureFeed(name, body.system, bus)
    return EstimateFeed(name, bus)
