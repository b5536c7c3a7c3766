"""Simulates measured ranges: true distances with noise, lasting errors, reflections and silence."""

import math
from collections.abc import Iterable

import numpy as np

from groundstation.arrays import Array
from groundstation.geometry.rotations import rotation_from_euler
from sim_bridge.fault_kinds import Fault, FaultKind
from sim_bridge.site import SiteRanging, SiteTransponder
from sim_bridge.world.noise import GaussMarkov, standard_normals

# Half of the lasting error is the anchor's, constant for all robots; half is the pair's, and changes as reflections do.
_SHARE = math.sqrt(0.5)
_REFLECTIONS_LAST_S = 10.0
# By how much a reflection is longer [m], and how often an anchor does not answer.
_DETOUR_LEAST_M, _DETOUR_M, _SILENT_SHARE = 0.2, 0.5, 0.03


class Radios:
    """The radios of one system; `ranges_m` is one round with one robot.

    errors: whether there are lasting errors; all else is noise of each round. faults: those of this system.
    """

    def __init__(
        self, system: SiteRanging, errors: bool, rng: np.random.Generator, faults: Iterable[Fault] = ()
    ) -> None:
        self._system, self._rng, self._errors = system, rng, errors
        std_m = _SHARE * system.bias_std_m
        self._own = {anchor: std_m * float(rng.standard_normal()) for anchor in system.anchors}
        self._pairs: dict[tuple[str, str], GaussMarkov] = {}
        self._frozen = tuple(fault for fault in faults if fault.kind is FaultKind.ANCHOR_FROZEN)
        self._last_m: dict[tuple[str, str], float] = {}

    def ranges_m(self, robot: str, row: Array, now_s: float = 0.0) -> dict[str, float]:
        """Return the distance of a robot's transponder to each anchor that answers [m]; row: as `World.states`."""
        system, rng = self._system, self._rng
        own = system.transponders.get(robot, SiteTransponder())
        place = row[:3] + rotation_from_euler(*row[6:9].tolist()) @ np.array(own.position_m)
        told = {}
        for anchor, at in system.anchors.items():
            off_m = self._lasting_m(anchor, robot) + system.range_std_m * float(rng.standard_normal())
            chance, silent = rng.random(2)
            if chance < system.outlier_share:
                off_m += _DETOUR_LEAST_M + float(rng.exponential(_DETOUR_M))
            distance = math.dist(place.tolist(), at)
            if silent >= _SILENT_SHARE and distance <= system.reach_m:
                told[anchor] = max(0.0, distance + off_m)
        for fault in self._frozen:
            held_m = self._last_m.get((robot, str(fault.other)))
            if fault.covers(now_s) and fault.other in told and held_m is not None:
                told[fault.other] = held_m
        self._last_m |= {(robot, anchor): m for anchor, m in told.items()}
        return told

    def _lasting_m(self, anchor: str, robot: str) -> float:
        pair = self._pairs.get((anchor, robot))
        if pair is None:
            draw, system = standard_normals(self._rng), self._system
            pair = GaussMarkov(_SHARE * system.bias_std_m, _REFLECTIONS_LAST_S, 1.0 / system.rate_hz, draw)
            self._pairs[anchor, robot] = pair
        return self._own[anchor] + pair.step() if self._errors else 0.0
