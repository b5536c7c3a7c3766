"""Computes verdicts, on a thread beside the loop or in the loop itself."""

import threading
from collections.abc import Callable
from typing import Protocol

from groundstation.diagnosis.suspects import Verdict

Judge = Callable[[], Verdict | None]
"""Returns a verdict, or None if there is too little to judge."""


class Judging(Protocol):
    """Computes one verdict at a time: `begin` while not `busy`, then `take` the result."""

    @property
    def busy(self) -> bool:
        """Return whether a verdict is being reached."""

    def begin(self, judge: Judge) -> None:
        """Reach a verdict."""

    def take(self) -> Verdict | None:
        """Return and forget the verdict."""


class AtOnce:
    """Computes a verdict when it is taken, for use without a running clock."""

    busy = False

    def __init__(self) -> None:
        self._judge: Judge | None = None

    def begin(self, judge: Judge) -> None:
        """Remember the judge."""
        self._judge = judge

    def take(self) -> Verdict | None:
        """Return the verdict."""
        judge, self._judge = self._judge, None
        return None if judge is None else judge()


class OnThread:
    """Computes verdicts on threads of their own, for which nothing waits at the end."""

    def __init__(self) -> None:
        self._thread: threading.Thread | None = None
        self._verdict: Verdict | None = None

    @property
    def busy(self) -> bool:
        """Return whether a verdict is being reached."""
        return self._thread is not None and self._thread.is_alive()

    def begin(self, judge: Judge) -> None:
        """Start a thread that computes a verdict."""
        self._thread = threading.Thread(target=self._run, args=(judge,), name="verdict", daemon=True)
        self._thread.start()

    def _run(self, judge: Judge) -> None:
        self._verdict = judge()

    def take(self) -> Verdict | None:
        """Return and forget the verdict; None also if its thread failed, which is logged."""
        verdict, self._verdict = self._verdict, None
        return verdict
