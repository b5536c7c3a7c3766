"""Lands an AR.Drone whose optical flow sees no floor. Pure.

The firmware brakes by optical flow. Without it the drone would land level, and moving air would carry it off. So the
driver lets it sink and keeps braking it, to below the least height of its ultrasound; then the firmware lands it.
"""

from groundstation.time_units import NS_PER_MS, NS_PER_S

LOWEST_M = 0.35
# From there it sinks on by time: by 0.12 m at the usual 0.4 m/s.
_ON_NS = 300 * NS_PER_MS
_LONGEST_NS = 6 * NS_PER_S
# A drone commanded to sink does so after 0.7 s. One that does not sink is landed by its firmware.
_LOWER_M, _LOWER_WITHIN_NS = 0.1, 1_200 * NS_PER_MS


class BlindDescent:
    """Decides whether a landing drone sinks under its driver's braking.

    Never again after the firmware was commanded to land it.
    """

    def __init__(self) -> None:
        self._since_ns: int | None = None
        self._low_ns: int | None = None
        self._over = False
        self._reached_m, self._reached_ns = 0.0, 0

    def step(self, now_ns: int, lands: bool, blind: bool, height_m: float | None) -> bool:
        """Return whether it sinks.

        lands: it is to land; blind: it sees no floor, but its other reports are sound; height_m: above the floor, None
        if not reported.
        """
        if not lands:
            self._since_ns, self._low_ns, self._over = None, None, False
            return False
        if self._low_ns is None and height_m is not None and height_m <= LOWEST_M:
            self._low_ns = now_ns
        if self._low_ns is not None:
            self._over = self._over or not blind or now_ns - self._low_ns > _ON_NS
            return not self._over
        if not blind or height_m is None:
            self._over = True
            return False
        if self._since_ns is None or height_m <= self._reached_m - _LOWER_M:
            self._since_ns = now_ns if self._since_ns is None else self._since_ns
            self._reached_m, self._reached_ns = height_m, now_ns
        late = now_ns - self._reached_ns > _LOWER_WITHIN_NS or now_ns - self._since_ns > _LONGEST_NS
        self._over = self._over or late
        return not self._over
