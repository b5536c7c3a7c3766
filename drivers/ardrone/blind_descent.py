"""The landing of an AR.Drone whose optical flow sees no floor. Pure.

Its firmware lands level then: it stops by the optical flow that fails, and moving air carries it off. So the driver
lets it sink and goes on braking it, until it is so low that the firmware may land it.
"""

from groundstation.time_units import NS_PER_MS, NS_PER_S

LOWEST_M = 0.35
_LONGEST_NS = 6 * NS_PER_S
# Who is told to sink answers after 0.7 s. Whatever does not sink lands as its firmware does.
_LOWER_M, _LOWER_WITHIN_NS = 0.1, 1_200 * NS_PER_MS


class BlindDescent:
    """Says while a drone that is to land sinks under its driver's braking: never again once it was told to land."""

    def __init__(self) -> None:
        self._since_ns: int | None = None
        self._over = False
        self._reached_m, self._reached_ns = 0.0, 0

    def step(self, now_ns: int, lands: bool, blind: bool, height_m: float | None) -> bool:
        """Return whether it sinks.

        lands: it is to land; blind: it sees no floor, and all else that it says is sound; height_m: above the
        floor, None if it does not say.
        """
        if not lands:
            self._since_ns, self._over = None, False
            return False
        if not blind or height_m is None or height_m <= LOWEST_M:
            self._over = True
            return False
        if self._since_ns is None or height_m <= self._reached_m - _LOWER_M:
            self._since_ns = now_ns if self._since_ns is None else self._since_ns
            self._reached_m, self._reached_ns = height_m, now_ns
        late = now_ns - self._reached_ns > _LOWER_WITHIN_NS or now_ns - self._since_ns > _LONGEST_NS
        self._over = self._over or late
        return not self._over
