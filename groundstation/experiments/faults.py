"""The fault campaign: batches of seeded flights, each batch a process of the simulator, and the table of their ends."""

import hashlib
import json
import statistics
import subprocess
import sys
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from groundstation.errors import OperatorMistake
from groundstation.experiments.program_digest import program_digest
from groundstation.experiments.summary import worst

BATCH = 20
# Exit code of the simulator's study for an order that it does not understand.
_WRONG_ORDER = 2
HEALTHY = "none"
_SHOWN_SEEDS = 6
_WORST = (
    ("separation_m", min), ("fence_m", max), ("speed_m_s", max), ("unlocalised_s", max), ("hover_s", max),
    ("rest_s", max),
)  # fmt: skip


@dataclass(frozen=True, slots=True)
class FlightBatch:
    """Some flights of one campaign. order: the simulator's order without the seeds, as JSON; study: its name."""

    order: str
    seeds: tuple[int, ...]
    study: str = "faults"

    @property
    def key(self) -> str:
        """Return a name that only equal batches of the same program share."""
        digest = hashlib.sha256((self.order + program_digest()).encode()).hexdigest()[:12]
        return f"{self.study}-{digest}-{self.seeds[0]:06d}-{len(self.seeds)}"


class CampaignError(RuntimeError):
    """The simulator could not fly a batch."""


def batches(order: str, first_seed: int, flights: int, size: int = BATCH, study: str = "faults") -> list[FlightBatch]:
    """Return all batches of a campaign."""
    ends = range(first_seed, first_seed + flights, size)
    return [FlightBatch(order, tuple(range(a, min(a + size, first_seed + flights))), study) for a in ends]


def fly(batch: FlightBatch) -> dict[str, Any]:
    """Fly a batch in a process of its own; raises CampaignError or OperatorMistake with its message."""
    order = json.loads(batch.order) | {"seeds": list(batch.seeds)}
    command = [sys.executable, "-m", "sim_bridge.study", batch.study]
    result = subprocess.run(command, input=json.dumps(order), capture_output=True, text=True, check=False)
    if result.returncode == _WRONG_ORDER:
        raise OperatorMistake(result.stderr.strip())
    if result.returncode != 0:
        raise CampaignError(result.stderr.strip()[-2000:])
    flights = [json.loads(line) for line in result.stdout.splitlines()]
    timing = [flight.pop("spent_s") for flight in flights]
    return {"task": {"batch": batch.key}, "merits": {"flights": flights}, "timing": {"flights": timing}}


def flights_of(rows: Iterable[Mapping[str, Any]]) -> tuple[list[dict[str, Any]], list[dict[str, float]]]:
    """Return the verdicts on all flights, and the time spent on each."""
    flights, timing = [], []
    for row in rows:
        flights += row["merits"]["flights"]
        timing += row["timing"]["flights"]
    return flights, timing


def by_kind(flights: Sequence[Mapping[str, Any]]) -> list[dict[str, Any]]:
    """Return one row for each kind of fault, then one for flights with none; a flight with two faults counts in both.

    flights: number flown; unsafe: number that ended so, alone: those with this fault only; worst figures; why:
    how often each bound was broken first; seeds: of unsafe ends, those with this fault only first.
    """
    rows = []
    kinds = sorted({kind for flight in flights for kind in flight["kinds"]})
    for kind in (*kinds, HEALTHY):
        mine = [f for f in flights if (kind in f["kinds"] if kind != HEALTHY else not f["kinds"])]
        flown = [f for f in mine if f["tracking_since_s"] is not None]
        if not mine:
            continue
        unsafe = sorted((f for f in flown if f["unsafe"]), key=lambda f: (len(f["faults"]), f["seed"]))
        why: dict[str, int] = {}
        for flight in unsafe:
            first = next(iter(flight["unsafe"]))
            why[first] = why.get(first, 0) + 1
        rows.append(
            {
                "kind": kind,
                "flights": len(flown),
                "not_flown": len(mine) - len(flown),
                "unsafe": len(unsafe),
                "alone": sum(len(f["faults"]) == 1 for f in flown),
                "unsafe_alone": sum(len(f["faults"]) == 1 for f in unsafe),
                "stopped": sum(any(mode != "TRACK" for mode in f["modes"].values()) for f in flown),
                **{key: worst(flown, key, pick) for key, pick in _WORST},
                "why": dict(sorted(why.items(), key=lambda item: -item[1])),
                "seeds": [f["seed"] for f in unsafe],
            }
        )
    return rows


def totals(flights: Sequence[Mapping[str, Any]], timing: Sequence[Mapping[str, float]]) -> dict[str, Any]:
    """Return the figures of the whole campaign, and its time by parts (shares of the loop)."""
    flown = [flight for flight in flights if flight["tracking_since_s"] is not None]
    parts = {name: sum(t.get(name, 0.0) for t in timing) for name in (timing[0] if timing else ()) if name != "cpu"}
    spent = sum(parts.values())
    cpu_s = sum(t["cpu"] for t in timing)
    return {
        "flights": len(flown),
        "unsafe": sum(bool(flight["unsafe"]) for flight in flown),
        "unreached": [f["seed"] for f in flown if f["unsafe"] and set(f["unsafe"]) == set(f["unreached"])],
        "deaf": _deaf([spell for flight in flown for spell in flight["deaf"]]),
        "not_flown": [flight["seed"] for flight in flights if flight["tracking_since_s"] is None],
        "false_alarms": [f["seed"] for f in flown if not f["kinds"] and set(f["modes"].values()) != {"TRACK"}],
        "cpu_s_per_flight": round(cpu_s / max(1, len(timing)), 2),
        "time_shares": {name: round(value / spent, 2) for name, value in sorted(parts.items(), key=lambda i: -i[1])},
    }


def _deaf(spells: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """Return the number of spells in which a drone heard nothing, and its way and speed in them: median and most."""
    figures: dict[str, Any] = {"spells": len(spells)}
    for key in ("flown_m", "fastest_m_s") if spells else ():
        values = [spell[key] for spell in spells]
        figures |= {f"{key}_median": round(statistics.median(values), 3), f"{key}_most": max(values)}
    return figures


def ends_told(summary: Mapping[str, Any]) -> list[str]:
    """Return the campaign's result as lines of text; summary: of `totals`."""
    lines = [
        f"{summary['unsafe']} of {summary['flights']} flights ended unsafe; healthy flights stopped: "
        f"{summary['false_alarms'] or 'none'}; did not take off: {summary['not_flown'] or 'none'}"
    ]
    if unreached := summary["unreached"]:
        lines.append(
            f"  in {len(unreached)} of the unsafe ones a drone heard nothing, and nothing else had gone wrong: nobody "
            f"on the ground could stop it ({' '.join(map(str, unreached))})"
        )
    if (deaf := summary["deaf"])["spells"]:
        lines.append(
            f"  {deaf['spells']} times a drone heard nothing in flight: it flew on for {deaf['flown_m_median']:.2f} m "
            f"(median; {deaf['flown_m_most']:.2f} m at most) at up to {deaf['fastest_m_s_most']:.2f} m/s"
        )
    return lines


def table(rows: Sequence[Mapping[str, Any]]) -> list[str]:
    """Return the rows as lines of text."""
    heads = ("fault", "flights", "unsafe", "alone", "sep m", "fence m", "m/s", "lost s", "hover s", "rest s")
    head = "{:18s} {:>7s} {:>6s} {:>7s} {:>6s} {:>7s} {:>5s} {:>6s} {:>7s} {:>6s}".format(*heads)
    lines = [f"{head}  first broken; seeds"]
    for row in rows:
        figures = [f"{row[key]:.2f}" if row[key] is not None else "-" for key, _ in _WORST]
        alone = f"{row['unsafe_alone']}/{row['alone']}"
        why = ", ".join(f"{what} {count}" for what, count in row["why"].items())
        seeds = " ".join(map(str, row["seeds"][:_SHOWN_SEEDS])) + (" ..." if len(row["seeds"]) > _SHOWN_SEEDS else "")
        lines.append(
            "{:18s} {:7d} {:6d} {:>7s} {:>6s} {:>7s} {:>5s} {:>6s} {:>7s} {:>6s}  {}".format(
                row["kind"], row["flights"], row["unsafe"], alone, *figures, f"{why}; {seeds}" if why else ""
            )
        )
    return lines
