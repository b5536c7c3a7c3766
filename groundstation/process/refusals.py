"""Refused input, as a line for the operator: rising counts are reported, but not each time."""

from collections.abc import Mapping

from groundstation.time_units import NS_PER_S

_PERIOD_NS = 10 * NS_PER_S


class Refusals:
    """Compares counts of refusals, by reason, with those already reported.

    words: texts of reasons for the operator; other reasons are harmless and not reported.
    """

    def __init__(self, words: Mapping[str, str]) -> None:
        self._words = words
        self._told: dict[str, int] = {}
        self._next_ns = 0

    def news(self, now_ns: int, counts: Mapping[str, int]) -> str:
        """Return the refusals since the last report in words, "" if none; at most once in 10 s."""
        fresh = {reason: counts.get(reason, 0) - self._told.get(reason, 0) for reason in self._words}
        fresh = {reason: count for reason, count in fresh.items() if count > 0}
        if not fresh or now_ns < self._next_ns:
            return ""
        self._next_ns = now_ns + _PERIOD_NS
        self._told |= {reason: counts[reason] for reason in fresh}
        return ", ".join(f"{count} {self._words[reason]}" for reason, count in fresh.items())
