"""The velocity that an AR.Drone reports while its optical flow finds nothing below."""

import math
from dataclasses import replace
from enum import IntEnum

from sim_bridge.fault_kinds import Fault
from sim_bridge.world.airframe import GRAVITY_M_S2
from sim_bridge.world.noise import generator_of, standard_normals
from sim_bridge.world.readings import Readings

_NOISE_M_S, _LEAK_NOISE_M_S, _LEAK_S = 0.03, 0.01, 2.0


class BlindReport(IntEnum):
    """What the velocity then shows; unmeasured, a real drone may do any of them.

    ZERO: exactly 0; NOISE: noise of 3 cm/s about 0; TILTS: the integral of the reported tilts from the last correct
    velocity on, leaking away within 2 s.
    """

    ZERO = 0
    NOISE = 1
    TILTS = 2


class BlindFlow:
    """One uniform floor's effect on the readings of a drone; call it once per tick."""

    def __init__(self, fault: Fault) -> None:
        self._report = BlindReport(round(fault.amount))
        self._draw = standard_normals(generator_of(round(1000 * fault.start_s), fault.entity))
        self._velocity: tuple[float, float] | None = None
        self._elapsed_s = 0.0

    def __call__(self, r: Readings, _amount: float, _direction_rad: float, elapsed_s: float) -> Readings:
        """Return the readings to report."""
        dt_s, self._elapsed_s = elapsed_s - self._elapsed_s, elapsed_s
        match self._report:
            case BlindReport.ZERO:
                forward, left = 0.0, 0.0
            case BlindReport.NOISE:
                forward, left = _NOISE_M_S * self._draw(), _NOISE_M_S * self._draw()
            case BlindReport.TILTS:
                x, y = (r.vx, r.vy) if self._velocity is None else self._velocity
                x += (GRAVITY_M_S2 * math.tan(r.pitch) - x / _LEAK_S) * dt_s
                y += (-GRAVITY_M_S2 * math.tan(r.roll) - y / _LEAK_S) * dt_s
                self._velocity = x, y
                forward, left = x + _LEAK_NOISE_M_S * self._draw(), y + _LEAK_NOISE_M_S * self._draw()
        return replace(r, velocity=(forward, left, r.vz))
