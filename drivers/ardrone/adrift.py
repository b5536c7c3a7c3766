"""Detects an AR.Drone, silent or doubted, that drifts off though commanded to hold its place. Pure.

Such a drone does not report whether its optical flow sees the floor. Cameras show it: sound firmware brakes from full
speed in a second.
"""

import math

from groundstation.time_units import NS_PER_MS

# Its firmware brakes within a second, and a speed between two places half a second apart is 0.3 s old.
_BRAKES_WITHIN_NS = 1300 * NS_PER_MS
# Three deviations of a speed between two places that cameras know to 2 cm, half a second apart; a drone that holds its
# place wanders at 0.05 m/s.
_ADRIFT_M_S = 0.12


class AdriftWatch:
    """Detects when the driver must brake a drone that drifts.

    It must from the detection on, as long as cameras see the drone while it is silent or doubted and must hold its
    place.
    """

    def __init__(self) -> None:
        self._since_ns: int | None = None
        self.adrift = False

    def step(self, now_ns: int, holds: bool, silent: bool, seen_m_s: tuple[float, float] | None) -> bool:
        """Return whether it is adrift.

        holds: its command is to hold its place; silent: it reports nothing new, or a doubted
        velocity; seen_m_s: its velocity by cameras.
        """
        if not holds or not silent:
            self._since_ns, self.adrift = None, False
            return False
        self._since_ns = now_ns if self._since_ns is None else self._since_ns
        late = now_ns - self._since_ns >= _BRAKES_WITHIN_NS
        self.adrift = seen_m_s is not None and (self.adrift or (late and math.hypot(*seen_m_s) > _ADRIFT_M_S))
        return self.adrift
