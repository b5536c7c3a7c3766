"""Places over which a robot may be at any height: one that climbs, or flies and is not in the belief. Pure.

A robot joins the belief when its vehicle reports flight and a camera sees it. It has left the floor by then: the
others must keep away from where it does so.
"""

from collections.abc import Collection, Mapping
from dataclasses import dataclass, replace

import numpy as np

from groundstation.arrays import Array
from groundstation.bus.messages import Message, RangeObservation, RelativeObservation, VehicleStatus, climbs, flies
from groundstation.control.parameters import SafetyParameters
from groundstation.estimation.belief import JointBelief
from groundstation.estimation.models import FixedMount, MountedCamera
from groundstation.estimation.parameters import EstimatorParameters
from groundstation.time_units import NS_PER_S

# Variance of a pad's place, and of one that a single sighting shows [m^2].
_VARIANCE_M2 = 0.05**2
# A robot that nobody finds has landed by then.
_DRIFTS_S = 10.0


@dataclass(frozen=True, slots=True)
class Shaft:
    """A place (x, y) [m; world], its variance along each axis [m^2], and how far a robot may have drifted since [m]."""

    x: float
    y: float
    variance: float = _VARIANCE_M2
    drifted_m: float = 0.0


class Shafts:
    """Use: `hear` each status, `see` the messages that count, `advance` with each belief, read `around`.

    A robot is where the belief has it, else where a sensor fixed in the room last saw it, else where the belief last
    had it; before all that on its pad. One that flew when this began has no place until it is seen.
    """

    def __init__(self, estimator: EstimatorParameters, safety: SafetyParameters) -> None:
        self._safety = safety
        self._mounts: dict[str, tuple[Array, Array]] = {}
        for sensor in estimator.sensors.values():
            if isinstance(sensor, MountedCamera):
                mount = estimator.entities[sensor.carrier]
                if isinstance(mount, FixedMount):
                    self._mounts[sensor.carrier] = sensor.rotation, np.add(mount.position_m, sensor.translation)
        self._climbing: set[str] = set()
        self._known: dict[str, tuple[int, Shaft]] = {}

    def hear(self, status: VehicleStatus, now_ns: int) -> None:
        """Take the status of a robot."""
        name, aloft = status.header.entity, flies(status.flight_state, status.mode)
        pad = self._safety.pads.get(name)
        if pad is None:
            return
        climbing = climbs(status.flight_state, status.mode)
        if climbing:
            self._climbing.add(name)
        elif aloft is not None:
            self._climbing.discard(name)
        if climbing or aloft is False:
            self._known.setdefault(name, (now_ns, Shaft(*pad)))
        if aloft is False:
            self._known[name] = now_ns, self._known[name][1]  # what stands does not drift

    def see(self, message: Message, now_ns: int) -> None:
        """Take a sighting by a sensor fixed in the room; other messages change nothing."""
        match message:
            case RelativeObservation() if message.observer in self._mounts and message.subject in self._safety.pads:
                rotation, place = self._mounts[message.observer]
                x, y, _ = (place + rotation @ np.array(message.position_m)).tolist()
                self._known[message.subject] = now_ns, Shaft(x, y)
            case RangeObservation(position_m=(x, y, _)) if message.subject in self._safety.pads:
                variance = max(message.covariance[0], message.covariance[4])
                self._known[message.subject] = now_ns, Shaft(x, y, variance)

    def advance(self, belief: JointBelief, velocities: Mapping[str, Collection[float]]) -> None:
        """Note where each robot of the belief would come to rest; velocities [m/s; world]."""
        for name in belief.layout.robots:
            vx, vy, _ = velocities[name]
            x, y = belief.mean_of(name)[:2].tolist()
            variance = float(belief.covariance_of(name).diagonal()[:2].max())
            lag_s = self._safety.reaction_s
            self._known[name] = belief.stamp_ns, Shaft(x + lag_s * vx, y + lag_s * vy, variance)

    def around(self, belief: JointBelief, airborne: Collection[str]) -> dict[str, Shaft]:
        """Return the shafts that the others have to keep out of, by robot."""
        found = {}
        for name in self._climbing.union(airborne).intersection(self._known):
            since_ns, shaft = self._known[name]
            age_s = min((belief.stamp_ns - since_ns) / NS_PER_S, _DRIFTS_S)
            if name in self._climbing or name not in belief.layout:
                found[name] = replace(shaft, drifted_m=self._safety.drift_m_s * max(0.0, age_s))
        return dict(sorted(found.items()))
