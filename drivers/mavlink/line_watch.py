"""Tells once, for each spell of it, that a serial line loses what the driver sends. Pure: times are passed in."""

from collections.abc import Mapping

from groundstation.time_units import NS_PER_S

# So many losses are a spell, which ends when there was none for this time.
_LOSSES, _OVER_NS = 10, 10 * NS_PER_S
_SPELLS = {
    "send_dropped": (
        "the serial line carries less than is sent: poses and setpoints are left out",
        "take a faster line, or a lower mavlink.vision_hz",
    ),
    "send_failed": ("the serial device takes nothing", "is it plugged in, does it have power?"),
}


class LineWatch:
    """Watches the counts of a serial link."""

    def __init__(self) -> None:
        self._before: dict[str, int] = {}
        self._lost: dict[str, int] = {}
        self._newest_ns: dict[str, int] = {}

    def news(self, now_ns: int, rejected: Mapping[str, int]) -> list[tuple[str, str]]:
        """Return (text, remedy) of each spell that begins; rejected: counts so far, by reason."""
        found = []
        for reason, told in _SPELLS.items():
            count = rejected.get(reason, 0)
            fresh, self._before[reason] = count - self._before.get(reason, 0), count
            if now_ns - self._newest_ns.get(reason, now_ns) > _OVER_NS:
                self._lost[reason] = 0
            if fresh <= 0:
                continue
            before, self._newest_ns[reason] = self._lost.get(reason, 0), now_ns
            self._lost[reason] = before + fresh
            if before < _LOSSES <= self._lost[reason]:
                found.append(told)
        return found
