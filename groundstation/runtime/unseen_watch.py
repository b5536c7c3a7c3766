"""Names robots that fly unlocalised for too long."""

import math
from collections.abc import Mapping

from groundstation.time_units import NS_PER_S

_REPEAT_NS = NS_PER_S


class UnseenWatch:
    """Finds robots that fly unlocalised for too long; their drivers land them."""

    def __init__(self, limit_s: float) -> None:
        self._limit_ns = round(limit_s * NS_PER_S)
        self._airborne_since: dict[str, int] = {}
        self._localised_ns: dict[str, int] = {}
        self._told: dict[str, int] = {}

    def step(self, now_ns: int, ages_s: Mapping[str, float]) -> list[str]:
        """Return the robots to name now; ages_s: for how long each airborne robot has not been localised.

        Infinite: never since it flies, or not since its belief was given up; then the earlier count continues.

        A name is repeated once a second for as long as it applies.
        """
        for name in [name for name in self._airborne_since if name not in ages_s]:
            del self._airborne_since[name]
            self._told.pop(name, None)
            self._localised_ns.pop(name, None)
        due = []
        for name, age_s in ages_s.items():
            since = self._airborne_since.setdefault(name, now_ns)
            if math.isfinite(age_s):
                self._localised_ns[name] = max(since, now_ns - round(age_s * NS_PER_S))
            unseen_ns = now_ns - self._localised_ns.get(name, since)
            if unseen_ns >= self._limit_ns and now_ns - self._told.get(name, now_ns - _REPEAT_NS) >= _REPEAT_NS:
                self._told[name] = now_ns
                due.append(name)
        return due
