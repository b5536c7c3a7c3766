"""Takes in the team's messages, and reaches one verdict after another.

A verdict takes half a second of a core, more with more robots; the work never takes more than a fifth of the time.
"""

from functools import partial

from groundstation.bus import clock
from groundstation.bus.api import Bus
from groundstation.bus.messages import Suspicion
from groundstation.bus.notice import Notice
from groundstation.bus.topics import SUSPICION
from groundstation.diagnosis.judging import Judging
from groundstation.diagnosis.suspects import Verdict, verdict_on
from groundstation.diagnosis.watch import FigureWatch
from groundstation.diagnosis.window import TOPICS, Window
from groundstation.field.resolved import ResolvedField
from groundstation.time_units import NS_PER_S

_PAUSE_NS = 5 * NS_PER_S  # between the beginnings of two verdicts at least
_PAUSES = 4  # times as long as the last verdict took
# The tracker finds a bumped or frozen camera within this time; until then a verdict would blame a figure for it.
_PROVES_NS = 2 * NS_PER_S
_CAPACITY = 8192


class Diagnosis:
    """Call `turn`: it takes in messages and informs the tracker; `notices` then holds those for the operator."""

    def __init__(self, bus: Bus, field: ResolvedField, judging: Judging) -> None:
        self.notices: list[Notice] = []
        self._bus, self._field, self._judging = bus, field, judging
        self._queue = bus.subscribe(TOPICS, capacity=_CAPACITY)
        self._window, self._watch = Window(field, clock.clock_id()), FigureWatch(field)
        self._begun_ns: int | None = None
        self._forgotten = 0  # when the last verdict was begun
        self._reached: Verdict | None = None  # and not announced yet
        self._due_ns = self._proven_ns = 0
        self._told_ns = 0

    @property
    def overflowed(self) -> int:
        """Return how many messages were dropped because they were not taken in time."""
        return self._queue.overflowed

    def turn(self, now_ns: int) -> None:
        """Take in messages; begin a verdict when one is due, and announce a finished one."""
        for received in self._queue.drain():
            if received.message is not None:
                self._window.take(str(received.key), received.message, now_ns)
        if self._judging.busy:
            return
        if self._begun_ns is not None:
            took_ns = now_ns - self._begun_ns
            self._due_ns = max(self._begun_ns + _PAUSE_NS, now_ns + _PAUSES * took_ns)
            self._proven_ns, self._begun_ns = self._begun_ns + _PROVES_NS, None
            self._reached = self._judging.take()
        if self._reached is not None and now_ns >= self._proven_ns:
            self._tell(self._reached, now_ns)
            self._reached = None
        if self._watch.figures and now_ns >= self._told_ns + _PAUSE_NS:
            self._publish(now_ns)  # for a console that was restarted since
        if now_ns >= self._due_ns and (flown := self._window.flown()) is not None:
            self._begun_ns, self._forgotten = now_ns, self._window.forgotten
            self._judging.begin(partial(verdict_on, flown, self._field))

    def _tell(self, verdict: Verdict, now_ns: int) -> None:
        """Announce a verdict, unless some of the sightings that it judged do not count any more."""
        if self._forgotten == self._window.forgotten:
            self.notices += self._watch.take(verdict, now_ns)
            self._publish(now_ns)

    def _publish(self, now_ns: int) -> None:
        self._told_ns = now_ns
        header = self._bus.header(self._bus.source, now_ns)
        self._bus.publish(SUSPICION, Suspicion(header=header, cause=self._watch.cause, figures=self._watch.figures))
