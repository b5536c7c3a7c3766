"""Whether a vehicle that is to land comes down, as cameras see it. Pure."""

import math
from collections.abc import Sequence

from groundstation.bus.messages import EntityEstimate

# A belief of a height errs by a few cm, and its climb over half a second by 0.1 m/s.
_RISES_M_S, _SINKS_M_S = 0.3, 0.2
# Where nobody has seen it: as high as rooms are.
_UNKNOWN_M = 3.0


class ComingDown:
    """Call `hear` with each estimate of the vehicle; height_m: its height by the last one."""

    def __init__(self) -> None:
        self.height_m = _UNKNOWN_M

    def hear(self, entity: EntityEstimate) -> None:
        """Take the tracker's estimate; one without a height changes nothing."""
        if len(entity.mean) >= 3:
            self.height_m = max(0.0, entity.mean[2])


def away(seen_m_s: Sequence[float] | None, climb_m_s: float | None, most_m_s: float) -> str:
    """Return how a vehicle moves that does not sink, in words, or "".

    seen_m_s, climb_m_s: velocity forward and left, and up, by cameras, None if they do not see it; most_m_s: the
    speed of a healthy vehicle.
    """
    if climb_m_s is not None and climb_m_s > _RISES_M_S:
        return f"it rises at {climb_m_s:.1f} m/s"
    sinks = climb_m_s is not None and climb_m_s < -_SINKS_M_S
    speed_m_s = 0.0 if seen_m_s is None else math.hypot(*seen_m_s)
    return f"it flies at {speed_m_s:.1f} m/s" if speed_m_s > most_m_s and not sinks else ""
