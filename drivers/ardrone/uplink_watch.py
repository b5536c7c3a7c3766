"""Watches whether an AR.Drone 2 receives its commands, by the number of the last one that it obeyed. Pure.

WIRE (docs/reference/ardrone.md 4.4, 2.3): REFERENCES ends with ui_seq, the sequence number of the last PCMD. Navdata
may come at full rate while the other direction is dead; the drone then keeps flying its last PCMD.
"""

from groundstation.bus.messages import Severity
from groundstation.bus.notice import Notice
from groundstation.time_units import NS_PER_MS

# A Wi-Fi link repeats a datagram for tenths of a second; 20 lost commands in a row are no chance.
_CUT_NS = 500 * NS_PER_MS
_REMEDY = (
    "the drone flies its last command on: move this computer or its access point nearer, and look for other senders"
)


class UplinkWatch:
    """Detects commands that no longer arrive in flight, and for how long they did not; `cut` while they do not."""

    def __init__(self) -> None:
        self.reset()

    def reset(self) -> None:
        """Begin anew, for a new connection."""
        self._obeyed: int | None = None
        self._moved_ns: int | None = None
        self._told = False

    @property
    def cut(self) -> bool:
        """Return whether commands do not arrive and this was reported to the operator."""
        return self._told

    def step(self, now_ns: int, obeyed: int, flies: bool) -> Notice | None:
        """Take the newest number that a drone reported, while telemetry arrives; returns an event for the operator.

        A drone whose number never changes does not report it, and is not judged.
        """
        if obeyed != self._obeyed:
            first, since_ns, told = self._obeyed is None, self._moved_ns, self._told
            self._obeyed, self._told = obeyed, False
            self._moved_ns = None if first else now_ns
            if told and since_ns is not None:
                lasted_s = (now_ns - since_ns) * 1e-9
                return Notice(Severity.INFO, f"commands arrive again after {lasted_s:.1f} s")
            return None
        if not flies:
            self._moved_ns = None if self._moved_ns is None else now_ns
            return None
        if self._told or self._moved_ns is None or now_ns - self._moved_ns < _CUT_NS:
            return None
        self._told = True
        silent_s = (now_ns - self._moved_ns) * 1e-9
        return Notice(Severity.WARNING, f"it has obeyed no command for {silent_s:.1f} s, though it is heard", _REMEDY)
