"""Doubts the velocity that an AR.Drone reports, by its commands and by cameras, until it is to be trusted again. Pure.

A velocity that cameras contradict for long, or one of nearly zero that commands do, means that the drone does not see
how it moves over the floor: its own hover, which uses the same optical flow, would not stop it. Any other contradiction
may come from a wrong scale or from wind, where its own hover stops it; cameras show whether it does.
"""

import math
from collections import deque

from drivers.ardrone.flow_watch import NO_MOTION_M_S
from drivers.ardrone.velocity_axis import SEEN_TICKS
from drivers.watchdog_types import Action
from groundstation.bus.messages import Vector3
from groundstation.time_units import NS_PER_MS, NS_PER_S

NO_FLOOR = "it does not see the floor below"
CONTRADICTS = "its velocity contradicts what was asked for"
# A camera that is bumped makes a drone seem to move for the time over which its speed is a mean: 0.6 s.
_SEEN_NS = 800 * NS_PER_MS
# In 32 healthy emulated flights no drone that reported to stand was seen faster than that by more.
_SEEN_M_S = 0.12
# Its commands say so too: a picture that jumps explains only the one, and a wrong drag only the other.
_COMMANDED_M_S, _BOTH_NS = 0.1, 400 * NS_PER_MS
# Sound firmware brakes within a second, and the seen speed is 0.3 s old: by the end of these and `_SEEN_NS` the drone
# stands. Three deviations of that speed are 0.12 m/s, and a slightly misleading floor accounts for 0.1 m/s more.
_BRAKES_WITHIN_NS = 500 * NS_PER_MS
_ADRIFT_M_S, _APART_M_S = 0.12, 0.2
# So much more for a wrong scale of the velocity of fast drones. In 36 healthy flights it was 0.07 m/s for as long as
# `_SEEN_NS`, and 0.16 m/s where the whole floor misleads by 0.1 m/s (`flow-bias`).
_SCALE = 0.3
_CONFIRMED_M_S, _CONFIRMED_NS = 0.12, NS_PER_S
_STANDS = frozenset({Action.WAIT, Action.IDLE, Action.CLEAR, Action.TAKE_OFF})


class VelocityDoubt:
    """Whether a drone's velocity is doubted, and why.

    reason: in words, "" without doubt; blind: it sees no floor, which holds until it has landed. Any other doubt ends
    when cameras have confirmed for a second that the drone stands, as it reports; unseen drones land meanwhile.
    """

    def __init__(self) -> None:
        self.reset()

    def reset(self) -> None:
        """Trust the velocity again: the drone stands."""
        self.blind = False
        self._contradicts = False
        self._told: deque[tuple[float, float]] = deque(maxlen=SEEN_TICKS)
        self._since_ns: dict[str, int] = {}

    @property
    def reason(self) -> str:
        """Return why the velocity is doubted, or ""."""
        return NO_FLOOR if self.blind else CONTRADICTS if self._contradicts else ""

    def contradict(self, now_ns: int, told_m_s: Vector3) -> bool:
        """Note that the reported velocity contradicts the commands; return whether cameras contradict it as well."""
        self._contradicts = True
        strays = now_ns - self._since_ns.get("strays", now_ns) >= _BOTH_NS
        self.blind = self.blind or strays or math.hypot(*told_m_s[:2]) < NO_MOTION_M_S
        return strays

    def step(
        self,
        now_ns: int,
        action: Action,
        told_m_s: Vector3 | None,
        seen_m_s: tuple[float, float] | None,
        commanded_m_s: float = 0.0,
        flown: bool = False,
    ) -> bool:
        """Take one turn; return whether cameras have just shown that the drone sees no floor.

        told_m_s: its velocity, None if it reports nothing new; seen_m_s: likewise by cameras, forward and left, None
        if they do not see it; commanded_m_s: the speed that its commands should show by now, 0 if unknown; flown: it
        follows a velocity, also back to the place of its hover.
        """
        if action in _STANDS:
            self.reset()
            return False
        if told_m_s is None:
            self._told.clear()
        else:
            self._told.append(told_m_s[:2])
        stands_ns = self._lasting(now_ns, "holds", action is Action.HOVER)
        if len(self._told) < SEEN_TICKS or seen_m_s is None:
            self._since_ns = {key: since_ns for key, since_ns in self._since_ns.items() if key == "holds"}
            return False
        told = sum(x for x, _ in self._told) / SEEN_TICKS, sum(y for _, y in self._told) / SEEN_TICKS
        claimed, speed, apart = math.hypot(*told), math.hypot(*seen_m_s), math.dist(told, seen_m_s)
        moves = claimed < NO_MOTION_M_S and speed > claimed + _SEEN_M_S
        drifts = stands_ns > _BRAKES_WITHIN_NS and speed > _ADRIFT_M_S and apart > _APART_M_S
        # Its own hover may brake it faster than cameras can follow: then only what began before it counts.
        flies = flown or (self._contradicts and "strays" in self._since_ns)
        strays = flies and apart > max(_APART_M_S, _SCALE * speed)
        stood = speed < _CONFIRMED_M_S and apart < _CONFIRMED_M_S
        if self._lasting(now_ns, "stood", stood) >= _CONFIRMED_NS:
            self._contradicts = False
        both = moves and commanded_m_s > claimed + _COMMANDED_M_S
        lasting = (
            ("moves", moves, _SEEN_NS),
            ("drifts", drifts, _SEEN_NS),
            ("strays", strays, _BOTH_NS if self._contradicts else _SEEN_NS),
            ("both", both, _BOTH_NS),
        )
        # All are followed at each turn: while one is shown, another may begin.
        shown = max(self._lasting(now_ns, what, holds) - enough_ns for what, holds, enough_ns in lasting) >= 0
        fresh, self.blind = shown and not self.blind, self.blind or shown
        return fresh

    def _lasting(self, now_ns: int, what: str, holds: bool) -> int:
        """Return for how long something has held [ns], 0 if it does not."""
        if not holds:
            self._since_ns.pop(what, None)
            return 0
        return now_ns - self._since_ns.setdefault(what, now_ns)
