"""When to send the order that stops the motors: once, for a second one may undo it. Pure."""

from dataclasses import dataclass

from groundstation.time_units import NS_PER_MS, NS_PER_S

# By then a vehicle without motors has fallen from 4 m and says so; the watchdog lands one that flies on 2 s after CUT.
_ANSWER_NS, _LATEST_NS = 1_200 * NS_PER_MS, NS_PER_S
_STANDS_M, _FELL_M = 0.2, 0.3


@dataclass(slots=True)
class CutOrder:
    """The order of one cut.

    WIRE (docs/reference/ros2.md 4): an Empty and a Trigger are events; for some nodes (ardrone_autonomy's `reset`) each
    one switches the emergency over. So another one follows only where odometry shows that the first was not obeyed.
    """

    _order_ns: int | None = None
    _sent_ns: int = 0
    _height_m: float = 0.0

    @property
    def was_sent(self) -> bool:
        """Return whether the node has got it."""
        return self._order_ns is not None

    def is_due(self, now_ns: int, order_ns: int, heard_ns: int, height_m: float, accepted: bool) -> bool:
        """Return whether to send it now.

        order_ns: when the operator, or a failsafe, ordered it; heard_ns, height_m: the last odometry and its height
        above the stand [m]; accepted: the node has answered that it obeys.
        """
        if self._order_ns is None:
            return True
        if now_ns - self._sent_ns < _ANSWER_NS:  # also of an operator's double click
            return False
        if order_ns != self._order_ns:
            return True
        told = heard_ns - self._sent_ns >= _LATEST_NS
        return told and not accepted and height_m >= _STANDS_M and height_m > self._height_m - _FELL_M

    def sent(self, now_ns: int, order_ns: int, height_m: float) -> None:
        """Note that it was sent, and from which height."""
        self._order_ns, self._sent_ns, self._height_m = order_ns, now_ns, height_m
