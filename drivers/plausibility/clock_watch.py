"""Compares a vehicle's own clock with ours: it may stand, or run late. Pure."""

from groundstation.time_units import NS_PER_S

_BUCKET_NS = 5 * NS_PER_S
# A clock that went back by less means an older packet. By more: the clock was set, or the vehicle was restarted; no
# link delays packets for so long.
_LONGEST_NS = 3 * NS_PER_S


class ClockWatch:
    """Compares the times at which values were made and received.

    The freshest of the last 5 to 10 s define the usual delay.
    """

    def __init__(self, wrap_s: float | None = None) -> None:
        self._wrap_ns = None if wrap_s is None else round(wrap_s * 1e9)
        self.reset()

    def reset(self) -> None:
        """Forget everything: for a vehicle that was restarted."""
        self._last_ns: int | None = None
        self._moved_ns = 0
        self._turns_ns = 0
        self._least: list[int] = []
        self._bucket_ns = 0

    def update(self, stamp_ns: int, vehicle_ns: int) -> tuple[float, float]:
        """Take receipt and vehicle time of a value.

        Return how long that time has stood, and how late the value is [s].
        """
        before = self._last_ns
        vehicle_ns += self._turns_ns
        if before is not None and vehicle_ns < before:
            vehicle_ns = self._wrapped(before, vehicle_ns)
            if vehicle_ns < before - _LONGEST_NS:
                self.reset()
                before = None
        if before is None or vehicle_ns != before:
            self._last_ns, self._moved_ns = vehicle_ns, stamp_ns
        return (stamp_ns - self._moved_ns) * 1e-9, self._late(stamp_ns, stamp_ns - vehicle_ns)

    def _wrapped(self, before: int, vehicle_ns: int) -> int:
        # A step back by more than half the clock's range is a wrap forwards.
        if self._wrap_ns is None or before - vehicle_ns < self._wrap_ns // 2:
            return vehicle_ns
        self._turns_ns += self._wrap_ns
        return vehicle_ns + self._wrap_ns

    def _late(self, stamp_ns: int, offset_ns: int) -> float:
        if not self._least or stamp_ns - self._bucket_ns > _BUCKET_NS:
            self._least = [offset_ns, *self._least[:1]]
            self._bucket_ns = stamp_ns
        self._least[0] = min(self._least[0], offset_ns)
        return (offset_ns - min(self._least)) * 1e-9
