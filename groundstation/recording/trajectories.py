"""The trajectory of each body over the last seconds, by its estimates at the time."""

from collections import deque
from collections.abc import Iterable

from groundstation.recording.viewers import Transform
from groundstation.time_units import NS_PER_MS, NS_PER_S

_LASTS_NS = 10 * NS_PER_S
_POSE_PERIOD_NS = 200 * NS_PER_MS
_PERIOD_NS = NS_PER_S


class Trajectories:
    """Keeps the poses of the last 10 s, five a second, and returns them once a second."""

    def __init__(self) -> None:
        self._poses: dict[str, deque[tuple[int, Transform]]] = {}
        self._pose_due_ns = self._due_ns = 0

    def take(self, now_ns: int, bodies: Iterable[Transform]) -> dict[str, list[Transform]]:
        """Return the trajectory of each body, oldest pose first, when one is due; else nothing.

        The trajectory of a body without estimates becomes shorter each time, and finally empty. After a backward step
        of the clock trajectories begin anew.
        """
        if now_ns < self._pose_due_ns - _POSE_PERIOD_NS:
            self._poses.clear()
            self._due_ns = now_ns
        elif now_ns < self._pose_due_ns:
            return {}
        self._pose_due_ns = now_ns + _POSE_PERIOD_NS
        for body in bodies:
            self._poses.setdefault(body.child, deque()).append((now_ns, body))
        if now_ns < self._due_ns:
            return {}
        self._due_ns = now_ns + _PERIOD_NS
        return self._handed_out(now_ns - _LASTS_NS)

    def _handed_out(self, from_ns: int) -> dict[str, list[Transform]]:
        for poses in self._poses.values():
            while poses and poses[0][0] < from_ns:
                poses.popleft()
        found = {name: [pose for _, pose in poses] for name, poses in self._poses.items()}
        self._poses = {name: poses for name, poses in self._poses.items() if poses}
        return found
