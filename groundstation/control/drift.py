"""Drift: a robot's motion beyond its commands, for which the output limiter allows. Pure."""

from collections import deque

import numpy as np

from groundstation.arrays import Array
from groundstation.time_units import NS_PER_S

_WINDOW_NS, _LEAST_NS = 2 * NS_PER_S, NS_PER_S
# After a pause it is not known which commands were obeyed meanwhile.
_GAP_NS = NS_PER_S // 2


class DriftWatch:
    """Motion of one robot's point of rest beyond its commands, over two seconds.

    A vehicle that follows the command c with lag T obeys d/dt (x + T v) = c + d: the difference over a window is d, for
    any cause: wind, a wrong odometry that cameras correct, another lag. Good to 0.02 m/s where positions are to 0.03 m.
    """

    def __init__(self) -> None:
        self._offsets: deque[tuple[int, Array]] = deque()
        self._flown, self._command, self._last_ns = np.zeros(3), np.zeros(3), 0

    def see(self, now_ns: int, rest: Array) -> Array:
        """Take the point of rest x + T v [m; world]; return d [m/s], zero while too little is known."""
        if not 0 < now_ns - self._last_ns <= _GAP_NS:
            self._offsets.clear()
            self._flown = np.zeros(3)
        else:
            self._flown = self._flown + self._command * ((now_ns - self._last_ns) / NS_PER_S)
        self._last_ns = now_ns
        self._offsets.append((now_ns, rest - self._flown))
        while now_ns - self._offsets[0][0] > _WINDOW_NS:
            self._offsets.popleft()
        (before_ns, before), (_, now) = self._offsets[0], self._offsets[-1]
        if now_ns - before_ns < _LEAST_NS:
            return np.zeros(3)
        drift: Array = (now - before) * (NS_PER_S / (now_ns - before_ns))
        return drift

    def note_command(self, command_m_s: Array) -> None:
        """Note the command of the robot from now on [m/s; world]."""
        self._command = command_m_s
