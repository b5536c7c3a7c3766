"""Takes in what the team sees, and reaches one verdict after another.

A verdict takes half a second of a core, and more with more robots: it is reached on a thread of its own, so that the
process beats meanwhile, and never takes more than a fifth of the time.
"""

import threading
from collections.abc import Callable

from groundstation.bus import clock
from groundstation.bus.messages import Suspicion
from groundstation.bus.topics import SUSPICION
from groundstation.calibration.flown import Flown
from groundstation.diagnosis.suspects import Verdict, verdict_on
from groundstation.diagnosis.watch import FigureWatch
from groundstation.diagnosis.window import TOPICS, Window
from groundstation.field.resolved import ResolvedField
from groundstation.process.child import Child
from groundstation.time_units import NS_PER_S

PAUSE_NS = 5 * NS_PER_S
"""Between two verdicts at least."""
_PAUSES = 4  # times as long as the last verdict took
_CAPACITY = 8192


class _Judging:
    """One verdict at a time on a thread of its own, which nothing waits for at the end."""

    def __init__(self, judge: Callable[[Flown], Verdict | None]) -> None:
        self._judge = judge
        self._thread: threading.Thread | None = None
        self._verdict: Verdict | None = None

    @property
    def busy(self) -> bool:
        """Return whether a verdict is being reached."""
        return self._thread is not None and self._thread.is_alive()

    def begin(self, flown: Flown) -> None:
        """Reach a verdict on a stretch of flight."""
        self._thread = threading.Thread(target=self._run, args=(flown,), name="verdict", daemon=True)
        self._thread.start()

    def _run(self, flown: Flown) -> None:
        self._verdict = self._judge(flown)

    def take(self) -> Verdict | None:
        """Return and forget the verdict."""
        verdict, self._verdict = self._verdict, None
        return verdict


class Diagnosis:
    """Takes in what the team sees; `turn` says what follows from it."""

    def __init__(self, child: Child, field: ResolvedField) -> None:
        self._child = child
        self._queue = child.bus.subscribe(TOPICS, capacity=_CAPACITY)
        self._window, self._watch = Window(clock.clock_id()), FigureWatch(field)
        self._judging = _Judging(lambda flown: verdict_on(flown, field))
        self._begun_ns = self._due_ns = 0
        self._was_busy = False

    @property
    def overflowed(self) -> int:
        """Return how many messages were dropped because nobody took them in time."""
        return self._queue.overflowed

    def turn(self, now_ns: int) -> None:
        """Take in what came; begin a verdict when one is due, and tell the one that was reached."""
        for received in self._queue.drain():
            if received.message is not None:
                self._window.take(str(received.key), received.message, now_ns)
        if self._judging.busy:
            return
        if self._was_busy:
            self._was_busy = False
            self._due_ns = max(self._begun_ns + PAUSE_NS, now_ns + _PAUSES * (now_ns - self._begun_ns))
            self._tell(now_ns)
        if now_ns >= self._due_ns and (flown := self._window.flown()) is not None:
            self._begun_ns, self._was_busy = now_ns, True
            self._judging.begin(flown)

    def _tell(self, now_ns: int) -> None:
        verdict = self._judging.take()
        if verdict is None:
            return
        for notice in self._watch.take(verdict):
            self._child.event(notice.severity, notice.text, notice.remedy, notice.entity or None)
        bus = self._child.bus
        bus.publish(SUSPICION, Suspicion(header=bus.header(self._child.name, now_ns), cause=self._watch.cause))
