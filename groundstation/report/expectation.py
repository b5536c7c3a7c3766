"""Expectations of a simulated flight's scenario, by its file at the time of the flight."""

from typing import Annotated, Any

import msgspec

from groundstation.report.run_facts import RunFacts

_Bound = Annotated[float, msgspec.Meta(ge=0.0)] | None


class Expectation(msgspec.Struct, frozen=True):
    """Bounds on a flight, None for no bound: see `expected` of scenario files. by: their source, in words."""

    rmse_m: _Bound = None
    lost_s: _Bound = None
    found_s: _Bound = None
    landings: Annotated[int, msgspec.Meta(ge=0)] = 0
    by: str = ""


NOTHING_SPECIAL = Expectation()


def expectation_of(facts: RunFacts) -> tuple[Expectation, str]:
    """Return a run's expectations, and why they could not be read; "" if they could or none were recorded."""
    if facts.expected is None:
        return NOTHING_SPECIAL, ""
    by = f"scenario {facts.scenario}" if facts.scenario else "its scenario"
    try:
        told: Any = facts.expected | {"by": by}
        return msgspec.convert(told, Expectation), ""
    except (TypeError, msgspec.ValidationError) as error:
        return NOTHING_SPECIAL, f"what {by} expects cannot be read ({error}): the usual limits are taken"
