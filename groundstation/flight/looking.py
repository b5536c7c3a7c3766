"""The checks before a take-off, from the first picture to the operator's list."""

from collections.abc import Collection, Iterator

from groundstation.doctor.finding import Finding, Level
from groundstation.preflight.judge import lines
from groundstation.runtime.before_take_off import BeforeTakeOff
from groundstation.time_units import NS_PER_MS, NS_PER_S

# Two pictures a second, the lowest rate met on a busy machine, make a median in this time.
_LONGEST_NS = 8 * NS_PER_S
_AGAIN_NS = 200 * NS_PER_MS
_STEADY_NS = 2 * NS_PER_S  # a changed list of drones to leave out is reported once it is stable for this long


class Looking:
    """One run of the checks. forbidden: a finding forbids the take-off; nobody: all drones would be left out.

    drones: the names of the team.
    """

    def __init__(self, checks: BeforeTakeOff, drones: Collection[str], now_ns: int) -> None:
        self._checks, self._drones, self._began_ns, self._next_ns = checks, drones, now_ns, now_ns
        self._left_out: tuple[str, ...] = ()
        self._told: tuple[str, ...] = ()
        self._findings: list[Finding] = []
        self._found_ns = now_ns
        self.forbidden = self.nobody = False

    def finished(self, now_ns: int) -> bool:
        """Return whether all evidence is in, or the wait was long enough."""
        if now_ns < self._next_ns:
            return False
        self._next_ns = now_ns + _AGAIN_NS
        if not self._checks.complete(now_ns) and now_ns - self._began_ns < _LONGEST_NS:
            return False
        self._found_ns, self._findings = now_ns, self._checks.findings(now_ns)
        self._left_out = self._checks.left_out(now_ns)
        self.nobody = set(self._left_out) >= set(self._drones)
        self.forbidden = any(one.level is Level.MUST for one in self._findings)
        return True

    def report(self, *, whole: bool) -> Iterator[str]:
        """Publish the findings and return them as lines; whole: including those that are OK."""
        self._checks.publish(self._findings, self._found_ns)
        yield from lines(one for one in self._findings if whole or one.level is not Level.OK)
        musts = sum(one.level is Level.MUST for one in self._findings)
        self._told = self._left_out
        yield f"before take-off: {musts or 'nothing'} must be mended{f'; {self._who()}' if self._left_out else ''}"

    def told_anew(self, now_ns: int) -> str:
        """Return words for the drones to leave out, if these changed for good since the last report; else ""."""
        if now_ns < self._next_ns:
            return ""
        self._next_ns, before = now_ns + _STEADY_NS, self._left_out
        self._left_out = self._checks.left_out(now_ns)
        if self._left_out != before or self._left_out == self._told:
            return ""
        self._told, self.nobody = self._left_out, set(self._left_out) >= set(self._drones)
        return f"before take-off: {self._who() if self._left_out else 'nobody would be left out any more'}"

    def _who(self) -> str:
        return "nobody would take off" if self.nobody else f"{' and '.join(self._left_out)} would be left out"
