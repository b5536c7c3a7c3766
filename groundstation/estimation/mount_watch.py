"""Finds fixed cameras that were moved in flight, and refuses their sightings until all robots have landed. Pure."""

import math
from collections.abc import Collection, Iterable, Mapping, Sequence

import numpy as np

from groundstation.arrays import Matrix, Vector
from groundstation.bus.messages import RelativeObservation, Severity
from groundstation.bus.notice import Notice
from groundstation.estimation.layout import EntityKind
from groundstation.estimation.measurement import Correction
from groundstation.estimation.models import FixedMount, MountedCamera
from groundstation.estimation.parameters import EstimatorParameters
from groundstation.estimation.sight_jumps import SightJumps
from groundstation.estimation.tied_contradictions import Pair, TiedContradictions
from groundstation.geometry.camera_turn import CameraTurn
from groundstation.time_units import NS_PER_S

MOVED = "its camera was moved: its sightings are not used until all have landed"
# A tracker that starts in flight knows by then which robots fly.
_NOBODY_NS = 5 * NS_PER_S
# A camera with a smaller displacement [m] is reported, but its sightings are used: the rooms' margins are wider.
_HARMS_M = 0.15
_REMEDY = (
    "land; fix the camera where the field file has it, or survey it anew (groundstation calibrate), then check again"
)


class MountWatch:
    """Call `see` with each sighting, `advance` once a tick; ask `distrusts` and `is_rootless`. roots: fixed sensors."""

    def __init__(self, parameters: EstimatorParameters) -> None:
        fixed: dict[str, Matrix] = {
            sensor.carrier: sensor.rotation
            for sensor in parameters.sensors.values()
            if isinstance(sensor, MountedCamera) and isinstance(parameters.entities[sensor.carrier], FixedMount)
        }
        mounts = {name: rotation for name, rotation in fixed.items() if name in parameters.world_cameras}
        robots = [name for name, model in parameters.entities.items() if model.kind is EntityKind.ROBOT]
        ranging = frozenset(parameters.ranging)
        self.roots, self._cameras, self._robots = frozenset(fixed) | ranging, frozenset(mounts), frozenset(robots)
        self._jumps, self._ties = SightJumps(mounts), TiedContradictions(mounts, robots)
        self._seen: dict[Pair, Vector] = {}
        self._moved: set[str] = set()
        self._turned: dict[str, float] = {}
        self._recalled_ns: int | None = None

    @property
    def cameras(self) -> frozenset[str]:
        """Return the cameras that are watched."""
        return self._cameras

    @property
    def moved(self) -> frozenset[str]:
        """Return the cameras whose sightings are refused."""
        return frozenset(self._moved)

    @property
    def turned_ns(self) -> Mapping[str, int]:
        """Return until when [ns] each camera that was bumped saw all in place; 0: that is not known.

        Sightings of some of these are used: of those that hardly turned.
        """
        return {name: round(NS_PER_S * max(0.0, since_s)) for name, since_s in self._turned.items()}

    def recall(self, moved: Collection[str], now_ns: int) -> list[Notice]:
        """Distrust cameras that were found to have moved before this watch began, in the same flight; returns notices.

        They are trusted again if no robot flies within 5 s.
        """
        self._moved |= self._cameras & frozenset(moved)
        self._turned |= dict.fromkeys(self._moved, 0.0)
        self._recalled_ns = now_ns
        what = "was bumped before the tracker was started anew; it is still not believed"
        return [Notice(Severity.ERROR, what + self._rest(), _REMEDY, name) for name in sorted(self._moved)]

    @property
    def is_rootless(self) -> bool:
        """Return whether no trusted fixed sensor is left to locate the team in the room."""
        return bool(self._moved) and self._moved == self.roots

    def distrusts(self, observer: str) -> bool:
        """Return whether a camera's sightings are to be refused."""
        return observer in self._moved

    def see(self, o: RelativeObservation) -> None:
        """Take a sighting that the filter was given."""
        if o.observer in self._cameras and o.subject in self._robots:
            self._seen[o.observer, o.subject] = np.array(o.position_m)
            self._jumps.see(o)

    def advance(
        self, now_ns: int, velocities: Mapping[str, Sequence[float]], corrections: Iterable[Correction],
        airborne: Collection[str],
    ) -> list[Notice]:  # fmt: skip
        """Return the notices for the operator. velocities [m/s; world] of all robots that have joined."""
        now_s = now_ns / NS_PER_S
        if airborne:
            self._recalled_ns = None
        elif self._recalled_ns is None or now_ns - self._recalled_ns > _NOBODY_NS:
            self._moved.clear()
            self._turned.clear()
        self._jumps.fly(now_s, velocities)
        self._ties.take(corrections, now_s)
        return [self._tell(turn) for turn in (*self._jumps.turns(), *self._ties.turns(now_s, self._seen))]

    def _tell(self, turn: CameraTurn) -> Notice:
        self._turned.setdefault(turn.camera, turn.since_s)
        angle = f"{math.degrees(turn.angle_rad):.1f} +- {math.degrees(turn.std_rad):.1f} deg"
        what = f"was bumped: all that it sees is displaced at once by {turn.displaced_m:.2f} m, as if turned by {angle}"
        if turn.displaced_m < _HARMS_M:
            return Notice(Severity.WARNING, what, _REMEDY, turn.camera)
        self._moved.add(turn.camera)
        return Notice(Severity.ERROR, f"{what}; it is not believed any more{self._rest()}", _REMEDY, turn.camera)

    def _rest(self) -> str:
        return "; no other camera tells where the team is, which hovers and lands" if self.is_rootless else ""
