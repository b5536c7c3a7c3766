"""The order of a study on standard input, and the loop that flies its seeds and prints a JSON line for each."""

import json
import sys
from collections.abc import Callable, Mapping
from contextlib import redirect_stdout
from dataclasses import dataclass
from typing import Any

from groundstation.errors import SettingsError
from groundstation.process import numba_cache
from groundstation.process.parent import end_with
from groundstation.process.program_digest import plugged_in, program_digest
from sim_bridge.scenario import Scenario, parse_scenario
from sim_bridge.study.faults.hosted_kinds import WRONG_ORDER, unhosted

_SHARED = ("field", "sections", "scenario", "seeds", "seconds")


class WrongOrder(ValueError):
    """An order that cannot be flown."""


@dataclass(frozen=True, slots=True)
class FlightOrder:
    """Order of a study.

    field: resolved, plain values; sections: of its drivers as (kind, section); own: keys of one study only.
    """

    field: dict[str, Any]
    sections: tuple[tuple[str, str], ...]
    scenario: Scenario
    seeds: tuple[int, ...]
    seconds: float
    own: Mapping[str, Any]


def fly_seeds(fly: Callable[[FlightOrder, int], dict[str, Any]]) -> int:
    """Fly each seed of the order; return WRONG_ORDER if it cannot be flown here, or `fly` or a plug-in refuses it.

    Standard output is for the results alone: what a plug-in prints goes to standard error. If the order names its
    parent, this process ends with that one: nobody else would read the results.
    """
    numba_cache.activate()
    results = sys.stdout
    try:
        values = json.load(sys.stdin)
        if parent_pid := values.pop("parent", None):
            end_with(parent_pid)
        order = order_of(values)
        # Read before the modules that fly are imported, so that it is not newer than they are.
        program = program_digest(plugged_in(order.field))
        with redirect_stdout(sys.stderr):
            for seed in order.seeds:
                print(json.dumps(fly(order, seed) | {"program": program}), file=results, flush=True)
    except (WrongOrder, SettingsError) as refusal:
        print(refusal, file=sys.stderr)
        return WRONG_ORDER
    return 0


def order_of(values: dict[str, Any]) -> FlightOrder:
    """Return an order from its JSON values; raises WrongOrder for a kind of vehicle that is not hosted."""
    if refusal := unhosted(values["field"]["drones"]):
        raise WrongOrder(refusal)
    return FlightOrder(
        values["field"],
        tuple((kind, section) for kind, section in values["sections"]),
        parse_scenario(json.dumps(values["scenario"])),
        tuple(values["seeds"]),
        values["seconds"],
        {name: value for name, value in values.items() if name not in _SHARED},
    )
