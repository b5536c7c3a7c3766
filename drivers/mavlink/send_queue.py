"""What waits for a serial line: orders first, then the rest, then the newest setpoint and pose. Pure.

A line that carries less than all would make everything late by its whole buffer, landings too. So the kernel gets no
more than the line carries in a tenth of a second, and frames are encoded, numbered and signed only when their turn is.
"""

from collections import deque
from collections.abc import Callable
from typing import NamedTuple

from drivers.mavlink.wire.frames import IDS, Message, id_of
from drivers.mavlink.wire.verification import number_of
from groundstation.time_units import NS_PER_MS, NS_PER_S

# A longest frame of 57600 baud takes 49 ms more.
_AHEAD_NS = 50 * NS_PER_MS
_STALE_NS = 300 * NS_PER_MS
# Requests are repeated sooner; a late one, such as a take-off, must not surprise anybody when a line moves again.
_EXPIRED_NS = NS_PER_S
_ORDERS = frozenset(IDS[name] for name in ("COMMAND_LONG", "COMMAND_INT", "SET_MODE"))
_SETPOINT = IDS["SET_POSITION_TARGET_LOCAL_NED"]
_STREAMS = frozenset((_SETPOINT, IDS["ODOMETRY"], IDS["VISION_POSITION_ESTIMATE"]))


class Waiting(NamedTuple):
    """A message to a vehicle, or a frame of somebody else, and when it came."""

    since_ns: int
    system: int
    content: Message | bytes


class SendQueue:
    """The frames that wait for a line, and for how long the line is still busy with earlier ones.

    drop: called for each frame that is left out: replaced by a newer one of its kind, or too old.
    """

    def __init__(self, bytes_per_s: float, drop: Callable[[], None]) -> None:
        self._ns_per_byte, self._drop = NS_PER_S / bytes_per_s, drop
        self._busy_until_ns = 0
        self._orders, self._others = deque[Waiting](), deque[Waiting]()
        self._newest: dict[tuple[int, int], Waiting] = {}  # by vehicle and kind

    def put(self, now_ns: int, system: int, content: Message | bytes) -> None:
        """Take a message, or one frame of any kind."""
        number = number_of(content) if isinstance(content, bytes) else id_of(type(content))
        waiting = Waiting(now_ns, system, content)
        if number in _STREAMS:
            if (system, number) in self._newest:
                self._drop()
            self._newest[system, number] = waiting  # in the place of the older one: each kind has its turn
        else:
            (self._orders if number in _ORDERS else self._others).append(waiting)
        self._forget_old(now_ns)

    def take(self, now_ns: int) -> Waiting | None:
        """Return what to send now; None while the line is busy, or nothing waits."""
        self._forget_old(now_ns)
        if self._busy_until_ns - now_ns > _AHEAD_NS:
            return None
        for queue in (self._orders, self._others):
            if queue:
                return queue.popleft()
        # Setpoints before poses, which are longer and would leave them too little; of equal ones the longest waiting.
        first = min(self._newest, key=lambda key: key[1] != _SETPOINT, default=None)
        return None if first is None else self._newest.pop(first)

    def note_sent(self, now_ns: int, size: int) -> None:
        """Note the length of a frame that goes out now."""
        self._busy_until_ns = max(now_ns, self._busy_until_ns) + round(size * self._ns_per_byte)

    def wait_ns(self, now_ns: int) -> int | None:
        """Return the time until the next one is due [ns], None while none waits."""
        if not (self._orders or self._others or self._newest):
            return None
        return max(0, self._busy_until_ns - _AHEAD_NS - now_ns)

    def _forget_old(self, now_ns: int) -> None:
        for queue in (self._orders, self._others):
            while queue and now_ns - queue[0].since_ns > _EXPIRED_NS:
                queue.popleft()
                self._drop()
        for key in [key for key, waiting in self._newest.items() if now_ns - waiting.since_ns > _STALE_NS]:
            del self._newest[key]
            self._drop()
