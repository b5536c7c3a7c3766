"""Operator notices about targets that are unseen for a moment: they may be hidden or gone."""

from collections.abc import Iterable, Mapping

from groundstation.bus.messages import Severity
from groundstation.bus.notice import Notice
from groundstation.estimation.belief import JointBelief

TELL_AFTER_S = 0.6
"""Time unseen after which a target may be hidden, or elsewhere."""


def unseen_words(name: str, unseen_s: float, place_m: Iterable[float]) -> str:
    """Return the message for a target that is unseen for a time [s] and expected at a place (x, y) [m; world]."""
    x, y = place_m
    return f"{name} is not seen for {unseen_s:.1f} s: it may be hidden near ({x:.1f}, {y:.1f})"


class UnseenTargets:
    """Reports each target once when it gets out of sight, and once when it is seen again."""

    def __init__(self) -> None:
        self._told: frozenset[str] = frozenset()

    def advance(self, belief: JointBelief, unseen_s: Mapping[str, float]) -> list[Notice]:
        """Return new notices; unseen_s: time since a picture last showed each target that is not searched for."""
        unseen = {name: age_s for name, age_s in unseen_s.items() if age_s > TELL_AFTER_S and name in belief.layout}
        told, self._told = self._told, frozenset(unseen)
        new = [
            (name, unseen_words(name, unseen[name], belief.mean_of(name)[:2])) for name in sorted(unseen.keys() - told)
        ]
        seen = sorted((told - unseen.keys()) & unseen_s.keys())
        return [
            *(Notice(Severity.WARNING, text, "", name) for name, text in new),
            *(Notice(Severity.INFO, f"{name} is seen again", "", name) for name in seen),
        ]
