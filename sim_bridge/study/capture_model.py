"""A motion capture system without a wire: true poses in, relative observations with its noise out."""

import math
from collections.abc import Iterable

import numpy as np

from groundstation.bus.messages import Header, RelativeObservation, SearchedPicture
from groundstation.geometry.rotations import euler_from_rotation, rotation_from_euler
from sim_bridge.fault_kinds import Fault, FaultKind, standing
from sim_bridge.mounting import generator_of_eye, surveyed
from sim_bridge.site import Site
from sim_bridge.world.world import World


class CaptureEye:
    """Reports all permitted bodies in the system's volume, as its driver does, but does not check their poses."""

    def __init__(
        self, name: str, site: Site, errors: bool, rng: np.random.Generator, faults: Iterable[Fault] = ()
    ) -> None:
        system = site.motion_capture[name]
        self.name, self.period_s, self.lateness_ms = name, 1.0 / system.rate_hz, system.delay_ms
        self._rotation, self._origin = surveyed(system, errors, rng)
        self._system, self._rng, self._seq = system, rng, 0
        self._turns = tuple(fault for fault in faults if fault.kind is FaultKind.BODY_TURNED)
        targets = {n: (0.0, 0.0, target.marker.height_m) for n, target in site.tracked.items()}
        robots = {n: drone.marker.position_m for n, drone in site.drones.items()}
        self._markers = (robots if "robots" in system.observes else {}) | (
            targets if "targets" in system.observes else {}
        )
        place, heading = system.pose_std_m**2, math.radians(system.heading_std_deg) ** 2
        self._covariance = tuple(np.diag([place, place, place, heading]).ravel().tolist())

    def look(self, world: World, stamp_ns: int, clock: str) -> list[RelativeObservation]:
        """Return the observations of one exposure."""
        states = dict(zip(world.bodies, world.states(), strict=True))
        box = self._system.volume_m
        seen = []
        for name, marker in self._markers.items():
            row = states[name]
            inside = zip(row[:3], (box.x_m, box.y_m, box.z_m), strict=True)
            if not all(low <= value <= high for value, (low, high) in inside):
                continue
            noise = self._rng.standard_normal(6)
            turn = math.radians(self._system.heading_std_deg) * noise[3:]
            turn[2] += self._turned_rad(name, world)
            base = self._rotation.T @ rotation_from_euler(*(row[6:9] + turn).tolist())
            origin = self._rotation.T @ (row[:3] - self._origin) + self._system.pose_std_m * noise[:3]
            x, y, z = (origin + base @ np.array(marker)).tolist()
            self._seq += 1
            seen.append(
                RelativeObservation(
                    header=Header(stamp_ns, clock, self.name, self.name, self._seq),
                    observer=self.name,
                    subject=name,
                    camera=self.name,
                    position_m=(x, y, z),
                    yaw_rad=euler_from_rotation(base)[2],
                    covariance=self._covariance,
                    margin=2.0,
                )
            )
        return seen

    def _turned_rad(self, name: str, world: World) -> float:
        fault = standing(self._turns, FaultKind.BODY_TURNED, world.time_s, name) if self._turns else None
        return math.radians(fault.amount) if fault else 0.0

    def searched(self, _seen: object, _stamp_ns: int, _clock: str) -> SearchedPicture | None:
        """Return nothing: a body that the system does not track may still be in its volume."""
        return None


def captures_of(site: Site, errors: bool, seed: int, faults: Iterable[Fault] = ()) -> list[CaptureEye]:
    """Return the motion capture systems of a site that are sensors of the tracker."""
    names = (name for name in site.motion_capture if name != site.truth.get("from"))
    return [CaptureEye(name, site, errors, generator_of_eye(seed, name), faults) for name in names]
