"""Places of standing drones by fixed cameras: the filter knows drones only once they fly. Pure."""

from collections.abc import Collection, Mapping
from dataclasses import dataclass

import numpy as np

from groundstation.arrays import Array
from groundstation.bus.messages import AIRBORNE, FlightState, RelativeObservation
from groundstation.field.room import WorldCamera
from groundstation.geometry.rotations import world_from_downward_optical
from groundstation.time_units import NS_PER_S

_SEEN_NS = 3 * NS_PER_S


@dataclass(frozen=True, slots=True)
class StandingDrone:
    """Place of its marker: x, y [m; world], heading [rad; world] or None; at_ns: time of the sighting."""

    name: str
    place_m: tuple[float, float]
    yaw_rad: float | None
    at_ns: int


class StandingDrones:
    """Keeps the last sighting of each drone by a fixed camera, as the camera is surveyed."""

    def __init__(self, cameras: Mapping[str, WorldCamera], drones: Collection[str]) -> None:
        self._poses: dict[str, tuple[Array, Array]] = {
            name: (world_from_downward_optical(camera.rotation_deg), np.array(camera.position_m))
            for name, camera in cameras.items()
        }
        self._drones = frozenset(drones)
        self._seen: dict[str, StandingDrone] = {}

    def see(self, sighting: RelativeObservation) -> None:
        """Take a sighting; those by drones, and those of targets, are ignored."""
        if sighting.observer not in self._poses or sighting.subject not in self._drones:
            return
        rotation, position = self._poses[sighting.observer]
        x, y, _ = position + rotation @ np.array(sighting.position_m)
        seen = StandingDrone(sighting.subject, (float(x), float(y)), sighting.yaw_rad, sighting.header.stamp_ns)
        self._seen[sighting.subject] = seen

    def now(
        self, now_ns: int, flight_states: Mapping[str, FlightState], known: Collection[str]
    ) -> tuple[StandingDrone, ...]:
        """Return the drones seen within 3 s, not airborne and not in the filter's belief (`known`)."""
        return tuple(
            seen
            for name, seen in self._seen.items()
            if name not in known
            and now_ns - seen.at_ns < _SEEN_NS
            and flight_states.get(name) not in AIRBORNE  # an unconnected one may stand there as well
        )
