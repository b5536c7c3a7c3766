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

_FOLLOWED, _EXACT = "is followed", "its pose is exact now"
GOOD_NEWS = frozenset({_FOLLOWED, _EXACT})


class PoseFeed(Protocol):
    """A source of poses of one real body. caveat: what is wrong with them, for the operator, or ""."""

    @property
    def caveat(self) -> str:
        """Return what is wrong with its poses."""

    def latest(self, now_ns: int) -> OutsidePose | None:
        """Return the newest pose, None if nothing new arrived."""

    def close(self) -> None:
        """Release its resources."""


class EstimateFeed:
    """The tracker's estimate of one robot; emulated cameras cannot correct it, for they do not show the robot."""

    caveat = ""  # the run says so at its start

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
        self._warned: dict[str, str] = {}
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
        """Return (name, line) for each body that got lost, is known again, or flies by doubtful poses, since the last.

        A simulator may send its exact poses only some seconds after others: they are not missed until it flies.
        """
        lines = []
        for name, puppet in self._puppets.items():
            why = puppet.nowhere
            if why != self._said[name]:
                self._said[name] = why
                line = f"{why}: emulated cameras neither show it nor send its pictures" if why else _FOLLOWED
                lines.append((name, line))
            if puppet.airborne and (caveat := self._feeds[name].caveat) != self._warned.get(name, ""):
                self._warned[name] = caveat
                lines.append((name, caveat or _EXACT))
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
