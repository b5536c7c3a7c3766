"""Watches whose commands an AR.Drone 2 obeys, by the number of the last: ours, nobody's, or another program's. Pure.

WIRE (docs/reference/ardrone.md 4.4, 2.2): REFERENCES ends with ui_seq, the sequence number of the last PCMD. Navdata
may come at full rate while the other direction is dead; the drone then keeps flying its last PCMD. Of two senders the
drone obeys the one with the higher numbers; to the other it looks just the same.
"""

from collections import deque

from groundstation.bus.messages import Severity
from groundstation.bus.notice import Notice
from groundstation.time_units import NS_PER_MS, NS_PER_S

# A Wi-Fi link repeats a datagram for tenths of a second; 20 lost commands in a row are no chance.
_CUT_NS = 500 * NS_PER_MS
_REMEDY = (
    "the drone flies its last command on: move this computer or its access point nearer, and look for other senders"
)
# One foreign number may be left by whoever spoke before us; so many within a second are somebody who speaks now.
_OTHERS, _OTHERS_NS = 5, NS_PER_S
_GONE_NS = 5 * NS_PER_S
# A firmware that has never told so many of our numbers may count something else.
_CREDIBLE = 3
ANOTHER = "another program commands it"
_END_OTHER = "end that program, or take its computer off the drone's network; LAND and CUT are obeyed all the same"


class UplinkWatch:
    """Detects commands that do not arrive in flight, and for how long they did not, and commands of somebody else.

    `hear` is called for each packet; another thread may call the rest. foreign: whether another program commands it.
    """

    def __init__(self) -> None:
        self.reset()

    def reset(self) -> None:
        """Begin anew, for a new connection."""
        self._obeyed: int | None = None
        self._own = self._owns = 0
        self._moved_ns: int | None = None
        self._cut_ns: int | None = None
        self._others: deque[int] = deque(maxlen=_OTHERS)
        self.foreign = False

    @property
    def cut(self) -> bool:
        """Return whether commands do not arrive and this was reported to the operator."""
        return self._cut_ns is not None

    def hear(self, now_ns: int, obeyed: int, sent: int) -> None:
        """Take the number that a packet reports; sent: the highest of ours so far, which only rise."""
        if obeyed in (0, self._obeyed):
            return
        first, self._obeyed = self._obeyed is None, obeyed
        if self._own < obeyed <= sent:
            self._own, self._owns = obeyed, self._owns + 1
            self._moved_ns = None if first else now_ns
        elif self._owns >= _CREDIBLE:
            self._others.append(now_ns)

    def step(self, now_ns: int, flies: bool) -> Notice | None:
        """Return an event for the operator; call it while telemetry arrives.

        A drone whose number never changes does not report it, and is not judged.
        """
        return self._look_for_others(now_ns) or self._look_for_cut(now_ns, flies)

    def _look_for_others(self, now_ns: int) -> Notice | None:
        others = tuple(self._others)
        if self.foreign and now_ns - others[-1] > _GONE_NS:
            self.foreign = False
            return Notice(Severity.INFO, "no other program commands it any more")
        if self.foreign or len(others) < _OTHERS or now_ns - others[0] > _OTHERS_NS:
            return None
        self.foreign = True
        return Notice(Severity.WARNING, f"{ANOTHER}: it obeys commands that are not ours", _END_OTHER)

    def _look_for_cut(self, now_ns: int, flies: bool) -> Notice | None:
        moved_ns, cut_ns = self._moved_ns, self._cut_ns
        if cut_ns is not None and moved_ns is not None and moved_ns > cut_ns:
            self._cut_ns = None
            return Notice(Severity.INFO, f"commands arrive again after {(moved_ns - cut_ns) * 1e-9:.1f} s")
        if not flies:
            self._moved_ns = None if moved_ns is None else now_ns
            return None
        if cut_ns is not None or moved_ns is None or now_ns - moved_ns < _CUT_NS:
            return None
        self._cut_ns = moved_ns
        silent_s = (now_ns - moved_ns) * 1e-9
        return Notice(Severity.WARNING, f"it has obeyed no command for {silent_s:.1f} s, though it is heard", _REMEDY)
