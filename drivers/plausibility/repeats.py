"""Measures how long a value has been the same to the last bit. Pure.

Estimates and measurements in flight never repeat for long: in a recorded flight of an AR.Drone no velocity came twice,
and no attitude stayed for longer than 24 ms.
"""

import math

from groundstation.geometry.stabilized_frame import STANDARD_GRAVITY_M_S2

# Two datagrams of one instant are no standstill.
_LEAST_SAMPLES = 4


class RepeatWatch:
    """Measures how long a value has stood. After a pause of `gap_s` the count begins anew.

    `FreezeWatch` of the estimator is its near twin: that has no gap, because sightings come and go, and answers yes or
    no for many sources. Neither package may import the other, and no package below both is about sensors.
    """

    def __init__(self, gap_s: float = 0.3) -> None:
        self._gap_ns = round(gap_s * 1e9)
        self.reset()

    def reset(self) -> None:
        """Forget everything."""
        self._value: object = None
        self._since_ns = self._last_ns = 0
        self._samples = 0

    def update(self, stamp_ns: int, value: object) -> float:
        """Take a value [hashable or tuple]; return for how long it has stood [s]."""
        if value != self._value or stamp_ns - self._last_ns > self._gap_ns:
            self._value, self._since_ns, self._samples = value, stamp_ns, 0
        self._last_ns = stamp_ns
        self._samples += 1
        return (stamp_ns - self._since_ns) * 1e-9 if self._samples >= _LEAST_SAMPLES else 0.0


class StandstillWatch:
    """Watches a velocity along one axis that stands, and the change of speed that the tilt implies meanwhile."""

    def __init__(self) -> None:
        self._repeats = RepeatWatch()
        self.reset()

    def reset(self) -> None:
        """Forget everything."""
        self._repeats.reset()
        self._stamp_ns = 0
        self._change_m_s = 0.0

    def update(self, stamp_ns: int, velocity_m_s: float, tilt_rad: float) -> tuple[float, float]:
        """Take a velocity and the tilt towards it; return (how long it has stood [s], size of the change [m/s])."""
        held_s = self._repeats.update(stamp_ns, velocity_m_s)
        if held_s == 0.0:
            self._change_m_s = 0.0
        else:
            self._change_m_s += STANDARD_GRAVITY_M_S2 * math.tan(tilt_rad) * (stamp_ns - self._stamp_ns) * 1e-9
        self._stamp_ns = stamp_ns
        return held_s, abs(self._change_m_s)
