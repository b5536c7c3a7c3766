"""Past alarms, with begin and end. Pure."""

from collections import deque
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

from groundstation.monitor.alarm import Alarm
from groundstation.time_units import NS_PER_S

_KEPT = 50
# An alarm that returns within this time was not over: a figure that wavers about its limit is one alarm.
_BREAK_NS = 2 * NS_PER_S


@dataclass(slots=True)
class _Episode:
    """One alarm from its begin to its end, by the clock of `note`; text: its latest wording.

    asks: whether it ever required an action.
    """

    about: str
    text: str
    asks: bool
    began_ns: int
    ended_ns: int | None = None

    def goes_on(self, now_ns: int) -> bool:
        return self.ended_ns is None or now_ns - self.ended_ns < _BREAK_NS


class AlarmLog:
    """The newest alarms of a run, including present ones."""

    def __init__(self) -> None:
        self._episodes: deque[_Episode] = deque(maxlen=_KEPT)

    def note(self, alarms: Iterable[Alarm], now_ns: int) -> None:
        """Begin, continue and end alarms, from all present ones."""
        standing: dict[str, Alarm] = {}
        for alarm in alarms:
            standing.setdefault(alarm.about, alarm)
        for episode in self._episodes:
            alarm_now = standing.pop(episode.about, None) if episode.goes_on(now_ns) else None
            if alarm_now is not None:
                episode.text, episode.ended_ns = alarm_now.text, None
                episode.asks |= alarm_now.asks
            elif episode.ended_ns is None:
                episode.ended_ns = now_ns
        self._episodes.extendleft(_Episode(one.about, one.text, one.asks, now_ns) for one in standing.values())

    def as_json(self) -> list[dict[str, Any]]:
        """Return the ended alarms, the latest begin first; times in milliseconds."""
        return [
            {"text": one.text, "asks": one.asks, "began": one.began_ns / 1e6, "ended": one.ended_ns / 1e6}
            for one in self._episodes
            if one.ended_ns is not None
        ]
