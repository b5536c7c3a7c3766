"""Judges whether a flying vehicle is in our mode, and when to request that mode again. Pure.

WIRE (docs/reference/mavlink.md 5.2): in flight PX4 takes OFFBOARD only while setpoints keep coming, so they come first.
Its heartbeat, once a second, reports a change of mode late; its answer to the request is there at once. An acceptance
does not count if a refusal follows (docs/reference/mavlink.md 5.15).
"""

from drivers.mavlink.requests import Requests
from drivers.mavlink.wire.names import Flavour
from groundstation.time_units import NS_PER_MS

STREAM_FIRST_NS = 1_200 * NS_PER_MS
KEY = "guided mode"  # of the request
_TAKEN_OVER_NS = 1_500 * NS_PER_MS
_REGAIN_NS = 1_400 * NS_PER_MS
# Three heartbeats, of which two may be lost. Setpoints meanwhile mean nothing to a vehicle that a pilot has taken.
_PROMISED_NS = 3_200 * NS_PER_MS


class ModeWatch:
    """Watches the mode of one vehicle. taken_over: a pilot or the autopilot itself has changed it.

    guided_ns: when it was in our mode last, or may be expected in it after an order.
    """

    def __init__(self, flavour: Flavour, requests: Requests) -> None:
        self.taken_over = False
        self.guided_ns = 0
        self._first_ns = STREAM_FIRST_NS if flavour is Flavour.PX4 else 0
        self._requests = requests
        self._ask_from_ns = self._ask_until_ns = self._promised_until_ns = 0

    def take_back(self, now_ns: int) -> None:
        """Claim the vehicle on an operator's order."""
        self.taken_over = False
        self.guided_ns = self._ask_from_ns = now_ns + self._first_ns
        self._ask_until_ns, self._promised_until_ns = self._ask_from_ns + _REGAIN_NS, 0
        self._requests.drop(KEY)
        self._requests.accepted.discard(KEY)

    def is_lost(self, now_ns: int, guided: bool, is_ours: bool) -> bool:
        """Take whether it reports our mode; return whether it has just been taken from us.

        is_ours: it flies by our setpoints. A mode that we did not request is a pilot's or the autopilot's own: it is
        not fought, and the mode is not requested a second time after it was accepted.
        """
        if guided:
            self._requests.drop(KEY)
            self._ask_until_ns = self._promised_until_ns = 0
        elif KEY not in self._requests.accepted:
            self._promised_until_ns = 0  # never accepted, or taken back by the second answer
        elif self._ask_until_ns and not self._promised_until_ns:
            self._promised_until_ns = now_ns + _PROMISED_NS
        if guided or not is_ours:
            self.guided_ns = now_ns
        late = now_ns - self.guided_ns > _TAKEN_OVER_NS and not self.is_promised(now_ns)
        return late and not self.taken_over

    def is_promised(self, now_ns: int) -> bool:
        """Return whether it has accepted our mode, though no heartbeat has reported it yet."""
        return now_ns < self._promised_until_ns

    def asks(self, now_ns: int) -> bool:
        """Return whether to request our mode now."""
        return self._ask_from_ns <= now_ns < self._ask_until_ns and not self._promised_until_ns
