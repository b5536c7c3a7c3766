"""Flights at message level in batches, each flown by a process of the simulator."""

import hashlib
import json
import os
import subprocess
import sys
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

from groundstation.errors import OperatorMistake
from groundstation.process.program_digest import plugged_in, program_digest

# Exit code of the simulator's study for an order that it does not understand.
_WRONG_ORDER = 2


@dataclass(frozen=True, slots=True)
class FlightBatch:
    """Some flights of one campaign. order: the simulator's order without the seeds, as JSON; study: its name."""

    order: str
    seeds: tuple[int, ...]
    study: str = "faults"

    @property
    def key(self) -> str:
        """Return a name that only equal batches of the same program, with the same plug-ins, share."""
        digest = hashlib.sha256((self.order + self.program).encode()).hexdigest()[:12]
        return f"{self.study}-{digest}-{self.seeds[0]:06d}-{len(self.seeds)}"

    @property
    def program(self) -> str:
        """Return the digest of the program that flies it, as this process began with it."""
        return program_digest(plugged_in(json.loads(self.order).get("field") or {}))


class CampaignError(RuntimeError):
    """The simulator could not fly a batch."""


def batches(order: str, first_seed: int, flights: int, size: int = 20, study: str = "faults") -> list[FlightBatch]:
    """Return all batches of a campaign."""
    ends = range(first_seed, first_seed + flights, size)
    return [FlightBatch(order, tuple(range(a, min(a + size, first_seed + flights))), study) for a in ends]


def fly(batch: FlightBatch) -> dict[str, Any]:
    """Fly a batch in a process of its own; raises CampaignError or OperatorMistake with its message."""
    order = json.loads(batch.order) | {"seeds": list(batch.seeds), "parent": os.getpid()}
    command = [sys.executable, "-m", "sim_bridge.study", batch.study]
    result = subprocess.run(command, input=json.dumps(order), capture_output=True, text=True, check=False)
    if result.returncode == _WRONG_ORDER:
        raise OperatorMistake(result.stderr.strip())
    if result.returncode != 0:
        raise CampaignError(_end(result.stderr))
    flights = [json.loads(line) for line in result.stdout.splitlines()]
    if [flight["seed"] for flight in flights] != list(batch.seeds):
        lost = f"{len(flights)} of {len(batch.seeds)} flights were reported"
        raise CampaignError(f"{batch.study}: {lost}; a plug-in may have ended the process: {_end(result.stderr)}")
    if {flight.pop("program", None) for flight in flights} != {batch.program}:
        raise CampaignError(
            f"{batch.study}: the program or a plug-in has changed since this campaign, or its worker, began: "
            "start it again"
        )
    timing = [flight.pop("spent_s") for flight in flights]
    return {"task": {"batch": batch.key}, "merits": {"flights": flights}, "timing": {"flights": timing}}


def _end(text: str) -> str:
    return text.strip()[-2000:] or "nothing was said"


def flights_of(rows: Iterable[Mapping[str, Any]]) -> tuple[list[dict[str, Any]], list[dict[str, float]]]:
    """Return the verdicts on all flights, and the time spent on each."""
    flights, timing = [], []
    for row in rows:
        flights += row["merits"]["flights"]
        timing += row["timing"]["flights"]
    return flights, timing
