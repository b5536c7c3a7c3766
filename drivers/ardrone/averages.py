"""Means of what came between two turns of the sender: the reader adds, the sender drains."""

import threading

from drivers.ardrone.convert import NavdataMotion


class MotionMean:
    """Means of velocity and horizontal specific force; one thread may add while another drains."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._waiting: list[NavdataMotion] = []
        self._velocity = (0.0, 0.0, 0.0)
        self._force: tuple[float, float] | None = None

    def add(self, motion: NavdataMotion) -> None:
        """Take the motion of one packet."""
        with self._lock:
            self._waiting.append(motion)
            del self._waiting[:-50]  # nobody drains while the sender stands still

    def drain(self) -> tuple[tuple[float, float, float], tuple[float, float] | None]:
        """Return (velocity, force forward and left or None) since the last call, or once more the last ones."""
        with self._lock:
            waiting, self._waiting = self._waiting, []
        if waiting:
            count = len(waiting)
            vx, vy, vz = (sum(motion.velocity_m_s[i] for motion in waiting) / count for i in range(3))
            self._velocity = (vx, vy, vz)
            forces = [motion.specific_force_m_s2 for motion in waiting if motion.specific_force_m_s2 is not None]
            self._force = None
            if forces:
                self._force = (sum(f[0] for f in forces) / len(forces), sum(f[1] for f in forces) / len(forces))
        return self._velocity, self._force
