"""All checks of one kind: each flight is flown once, when its first check needs it."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

from groundstation.errors import SettingsError
from sim_bridge.conformance import (
    checks_failsafe,
    checks_flight,
    checks_ground,
    checks_kind,
    checks_limits,
    checks_measured,
    checks_wire,
)
from sim_bridge.conformance.check import CHECKS, Case, Check, NotApplicable
from sim_bridge.conformance.flights import SCRIPTS
from sim_bridge.conformance.record import Record
from sim_bridge.conformance.script import fly
from sim_bridge.conformance.subject import subject_of

DAMAGED = 2000
_OBJECT = "kind"
SOURCES = (checks_kind, checks_ground, checks_flight, checks_limits, checks_measured, checks_failsafe, checks_wire)


@dataclass(frozen=True, slots=True)
class Verdict:
    """One check and its result: "passed", "failed" or "does not apply"; why: what was seen."""

    check: Check
    end: str
    why: str = ""


class Kit:
    """Judges a kind; options: keys of its sections set otherwise (SECTION.KEY=VALUE); damaged: damaged datagrams.

    Raises SettingsError for a kind that is not known or whose example is not complete.
    """

    def __init__(self, kind: str, options: Iterable[str] = (), damaged: int = DAMAGED) -> None:
        self.subject = subject_of(kind, options)
        self._damaged = damaged
        self._records: dict[str, Record] = {"": Record()}

    def record(self, flight: str) -> Record:
        """Return the record of a flight; it is flown when first asked for."""
        if flight not in self._records:
            self._records[flight] = fly(SCRIPTS[flight], self.subject, self._damaged)
        return self._records[flight]

    def judge(self, check: Check) -> Verdict:
        """Return the verdict of one check."""
        try:
            check.judge(Case(self.subject, self.record(check.flight)))
        except NotApplicable as reason:
            return Verdict(check, "does not apply", str(reason))
        except AssertionError as error:
            return Verdict(check, "failed", str(error).partition("\nassert")[0])
        except Exception as error:  # noqa: BLE001 - a kind's functions may raise anything: their failure is the verdict
            return Verdict(check, "failed", f"{type(error).__name__}: {error}")
        return Verdict(check, "passed")

    def verdicts(self, checks: Iterable[Check]) -> Iterator[Verdict]:
        """Yield the verdicts of some checks."""
        for check in checks:
            yield self.judge(check)


def chosen(words: str = "") -> list[Check]:
    """Return the checks whose name or flight is among words separated by commas; all without words.

    Raises SettingsError, with all valid words, for one that is neither.
    """
    wanted = {word.strip() for word in words.split(",") if word.strip()}
    flights = dict.fromkeys(one.flight or _OBJECT for one in CHECKS.values())
    unknown = ", ".join(sorted(wanted - set(CHECKS) - set(flights)))
    if unknown:
        names = ", ".join(sorted(CHECKS))
        raise SettingsError([f"--only: no flight and no check is called {unknown}", f"flights: {', '.join(flights)}",
                             f"checks: {names}"])  # fmt: skip
    return [one for one in CHECKS.values() if not wanted or {one.name, one.flight or _OBJECT} & wanted]
