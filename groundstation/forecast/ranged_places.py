"""The places that a system's ranges tell in the floor plan, by the fix that its driver computes from them."""

import math

import numpy as np

from groundstation.field.room import Ranging
from groundstation.geometry.multilateration import fix_from_ranges, likely_in
from groundstation.vectors import Vector3

_CELL_M = 0.2  # places as near as this to each other are told alike


class RangedPlaces:
    """Judges places [m; world] of a transponder in a system's box, and remembers its judgements."""

    def __init__(self, system: Ranging) -> None:
        box = system.volume_m
        self._system, self._likely = system, likely_in((box.x_m, box.y_m, box.z_m))
        # The rounds of one second: what lasts for longer does not average out.
        self._std_m = math.hypot(system.range_std_m / math.sqrt(system.rate_hz), system.bias_std_m)
        self._told: dict[Vector3, bool] = {}

    def tells(self, point_m: Vector3) -> bool:
        """Return whether error-free ranges put a transponder where it is in the plane, and leave little doubt.

        The fix begins anywhere in the box. Mirror images of anchors in one line or plane, and directions that no range
        tells, are thus found as in flight; the limit is that beyond which a drone is off its pad.
        """
        x, y, z = (_CELL_M * round(value / _CELL_M) for value in point_m)
        if (told := self._told.get((x, y, z))) is None:
            told = self._told[x, y, z] = self._is_fixed((x, y, z))
        return told

    def _is_fixed(self, point_m: Vector3) -> bool:
        ranges_m = {at: math.dist(at, point_m) for at in self._system.anchors.values()}
        near = {at: range_m for at, range_m in ranges_m.items() if range_m <= self._system.reach_m}
        fix = fix_from_ranges([*near], [*near.values()], self._std_m, *self._likely)
        if fix is None or math.dist(fix.position_m[:2], point_m[:2]) > self._system.pad_limit_m:
            return False
        worst_m2 = float(np.linalg.eigvalsh(fix.covariance[:2, :2])[1])
        return math.sqrt(worst_m2) <= self._system.pad_limit_m
