"""Means of the samples between two turns of the sender: the reader adds, the sender drains."""

import threading
from collections import deque

from drivers.ardrone.convert import NavdataMotion
from groundstation.bus.messages import Vector3

# In flight no measured velocity repeats: one that repeats this often is no measurement.
_REPEATED = 4
# The sender may stand still: then only the newest samples are kept.
_MOST_WAITING = 50


class MotionMean:
    """Means of velocity and horizontal specific force; one thread may add while another drains."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._waiting: deque[NavdataMotion] = deque(maxlen=_MOST_WAITING)
        self._velocity = (0.0, 0.0, 0.0)
        self._newest, self._standing = (0.0, 0.0), (1, 1)
        self._force: tuple[float, float] | None = None
        self._newest_force: Vector3 | None = None
        self._forces_standing = 0

    def add(self, motion: NavdataMotion) -> None:
        """Take the motion of one packet."""
        x, y, _ = motion.velocity_m_s
        with self._lock:
            self._waiting.append(motion)
            (before_x, before_y), (times_x, times_y) = self._newest, self._standing
            self._standing = (times_x + 1 if x == before_x else 1, times_y + 1 if y == before_y else 1)
            self._newest = (x, y)
            force = motion.specific_force_m_s2
            self._forces_standing = self._forces_standing + 1 if force == self._newest_force else 1
            self._newest_force = force

    @property
    def repeats(self) -> bool:
        """Return whether a horizontal velocity repeats to the last bit: the drone does not see its own motion."""
        return max(self._standing) >= _REPEATED

    @property
    def frozen(self) -> bool:
        """Return whether the accelerometers repeat as well, or are absent: the packets are old."""
        return self._forces_standing >= _REPEATED

    def drain(self) -> tuple[tuple[float, float, float], tuple[float, float] | None]:
        """Return (velocity, force forward and left or None) since the last call, or else the last ones again."""
        with self._lock:
            waiting = list(self._waiting)
            self._waiting.clear()
        if waiting:
            count = len(waiting)
            forward, left, up = zip(*(motion.velocity_m_s for motion in waiting), strict=True)
            self._velocity = (sum(forward) / count, sum(left) / count, sum(up) / count)
            forces = [motion.specific_force_m_s2 for motion in waiting if motion.specific_force_m_s2 is not None]
            self._force = None
            if forces:
                forward, left, _ = zip(*forces, strict=True)
                self._force = (sum(forward) / len(forces), sum(left) / len(forces))
        return self._velocity, self._force
