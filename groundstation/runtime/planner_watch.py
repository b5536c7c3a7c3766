"""A planner that fails or does not answer: why, logged once for each reason, and told to the operator by its name."""

import logging
import traceback

from groundstation import plug_ins
from groundstation.bus.messages import Severity
from groundstation.bus.notice import Notice
from groundstation.errors import GroundStationError
from groundstation.runtime.journal import Adoption
from groundstation.time_units import NS_PER_S

_log = logging.getLogger(__name__)

# An alarm stands for 8 s after the event that raised it.
_TOLD_AGAIN_NS = 5 * NS_PER_S
# Reasons may hold figures, and then each failure has its own.
_REASONS_TOLD, _REASONS_LOGGED = 3, 20
_LONGEST = 200


class FailureLog:
    """Puts the reasons of failures into words; the traceback of each is logged once, and of twenty at most."""

    def __init__(self) -> None:
        self._known: set[str] = set()

    def take(self, error: BaseException) -> str:
        """Return why planning failed, in one line."""
        # As in a traceback: an exception may fail to say what it is.
        known = isinstance(error, GroundStationError)
        reason = " ".join((str(error) if known else "".join(traceback.format_exception_only(error))).split())
        reason = reason if len(reason) <= _LONGEST else f"{reason[:_LONGEST]} ..."
        if reason not in self._known and len(self._known) < _REASONS_LOGGED:
            self._known.add(reason)
            _log.error("planning failed: %s", reason, exc_info=error)
        return reason


class PlannerWatch:
    """Call `take` each tick.

    plug_in: the name of another package's planner, "" for our own; max_plan_age_s: for how long a plan is flown.
    """

    def __init__(self, plug_in: str, max_plan_age_s: float) -> None:
        self._flown_s = max_plan_age_s
        self._answers_within_ns = int(2.0 * max_plan_age_s * NS_PER_S)
        self._name = plug_ins.planner_title(plug_in) or "the planner"
        self._told_ns: dict[str, int] = {}
        self._asked_ns: int | None = None

    def take(self, now_ns: int, adopted: Adoption | None, *, idle: bool) -> list[Notice]:
        """Return what the operator should know of the plan that came, if one did, and of one that does not come.

        Each reason once in 5 s, and three reasons at most.
        """
        self._told_ns = {told: at_ns for told, at_ns in self._told_ns.items() if now_ns - at_ns < _TOLD_AGAIN_NS}
        if idle or adopted is not None:
            self._asked_ns = None
        elif self._asked_ns is None:
            self._asked_ns = now_ns
        if adopted is not None and adopted.plan is None:
            text = f"{self._name} failed: {adopted.failure}"
            remedy = f"the last plan is flown for {self._flown_s:g} s, then drones that track hover"
            return self._once(now_ns, text, remedy)
        if self._asked_ns is not None and now_ns - self._asked_ns > self._answers_within_ns:
            remedy = "drones that track hover until it does; if it does not, land and fly with another planner"
            return self._once(now_ns, f"{self._name} does not answer", remedy)
        return []

    def _once(self, now_ns: int, text: str, remedy: str) -> list[Notice]:
        if text in self._told_ns or len(self._told_ns) >= _REASONS_TOLD:
            return []
        self._told_ns[text] = now_ns
        return [Notice(Severity.ERROR, text, remedy)]
