"""Whether a drone stands still and level, so that its attitude may be taken for level. Pure."""

import math

from drivers.ardrone.convert import NavdataMotion
from groundstation.time_units import NS_PER_MS, NS_PER_S

_STILL_NS = NS_PER_S
_GAP_NS = 300 * NS_PER_MS
# A hand that holds a drone level turns it faster; gyros of a drone that stands say less than 1 deg/s.
_LEVEL_RAD, _QUIET_RAD_S = math.radians(5), math.radians(5)


class Stillness:
    """Watches attitude and gyros; `stands` once they were level and quiet for a second on end."""

    def __init__(self) -> None:
        self._since_ns: int | None = None
        self._heard_ns = 0

    def update(self, now_ns: int, motion: NavdataMotion) -> None:
        """Take the motion in a packet."""
        level = _is_level(motion)
        quiet = motion.rates_rad_s is None or max(map(abs, motion.rates_rad_s)) < _QUIET_RAD_S
        if not (level and quiet):
            self._since_ns = None
        elif self._since_ns is None or now_ns - self._heard_ns > _GAP_NS:
            self._since_ns = now_ns
        self._heard_ns = now_ns

    @property
    def stands(self) -> bool:
        """Return whether it does, by the packets until the last one."""
        return self._since_ns is not None and self._heard_ns - self._since_ns >= _STILL_NS


def _is_level(motion: NavdataMotion) -> bool:
    # By gravity as well: a trim at a slant made its attitude wrong, and only another trim mends that.
    if max(abs(motion.roll_rad), abs(motion.pitch_rad)) < _LEVEL_RAD:
        return True
    force = motion.specific_force_m_s2
    return force is not None and math.hypot(force[0], force[1]) < math.tan(_LEVEL_RAD) * force[2]
