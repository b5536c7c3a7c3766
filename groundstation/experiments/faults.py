"""The fault campaign: rows by kind of fault, the totals, and both as text."""

import statistics
from collections.abc import Mapping, Sequence
from typing import Any

from groundstation.experiments.summary import worst

HEALTHY = "none"
_SHOWN_SEEDS = 6
# The whole, and the median of a plan within the tracker's time.
_NO_PARTS = ("cpu", "plan")
_WORST = (
    ("separation_m", min), ("fence_m", max), ("speed_m_s", max), ("unlocalised_s", max), ("hover_s", max),
    ("rest_s", max),
)  # fmt: skip


def by_kind(flights: Sequence[Mapping[str, Any]]) -> list[dict[str, Any]]:
    """Return one row for each kind of fault, then one for flights with none; a flight with two faults counts in both.

    flights: number that lifted off, which are judged; not_flown: number whose team did not all take off, and so never
    tracked; unsafe: number that ended so, alone: those with this fault only; stops_due, stops_judged: faults of the
    kind that demand a stop, and those whose stop was judged; worst figures; why: how often each bound was broken first;
    seeds: of unsafe ends, those with this fault only first.
    """
    rows = []
    kinds = sorted({kind for flight in flights for kind in flight["kinds"]})
    for kind in (*kinds, HEALTHY):
        mine = [f for f in flights if (kind in f["kinds"] if kind != HEALTHY else not f["kinds"])]
        flown = [f for f in mine if "unsafe" in f]
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
                "not_flown": sum(not _tracked(f) for f in mine),
                "unsafe": len(unsafe),
                "alone": sum(len(f["faults"]) == 1 for f in flown),
                "unsafe_alone": sum(len(f["faults"]) == 1 for f in unsafe),
                "stopped": sum(any(mode != "TRACK" for mode in f["modes"].values()) for f in mine if _tracked(f)),
                **_stops([fault for f in flown for fault in f["faults"] if fault["kind"] == kind]),
                **{key: worst(flown, key, pick) for key, pick in _WORST},
                "why": dict(sorted(why.items(), key=lambda item: -item[1])),
                "seeds": [f["seed"] for f in unsafe],
            }
        )
    return rows


def _stops(faults: Sequence[Mapping[str, Any]]) -> dict[str, int]:
    due = [fault["stop_judged"] for fault in faults if fault["stop_judged"] is not None]
    return {"stops_due": len(due), "stops_judged": sum(due)}


def totals(flights: Sequence[Mapping[str, Any]], timing: Sequence[Mapping[str, float]]) -> dict[str, Any]:
    """Return the figures of the whole campaign, and its time by parts (shares of the loop)."""
    flown = [flight for flight in flights if "unsafe" in flight]
    loop = [name for name in (timing[0] if timing else ()) if name not in _NO_PARTS]
    parts = {name: sum(t.get(name, 0.0) for t in timing) for name in loop}
    spent = sum(parts.values())
    cpu_s = sum(t["cpu"] for t in timing)
    return {
        "flights": len(flown),
        "unsafe": sum(bool(flight["unsafe"]) for flight in flown),
        **_stops([fault for flight in flown for fault in flight["faults"]]),
        "unreached": [f["seed"] for f in flown if f["unsafe"] and set(f["unsafe"]) == set(f["unreached"])],
        "deaf": _deaf([spell for flight in flown for spell in flight["deaf"]]),
        "not_flown": [flight["seed"] for flight in flights if not _tracked(flight)],
        "false_alarms": [
            f["seed"] for f in flights if _tracked(f) and not f["kinds"] and set(f["modes"].values()) != {"TRACK"}
        ],
        "cpu_s_per_flight": round(cpu_s / max(1, len(timing)), 2),
        "time_shares": {name: round(value / spent, 2) for name, value in sorted(parts.items(), key=lambda i: -i[1])},
    }


def _tracked(flight: Mapping[str, Any]) -> bool:
    """Return whether a flight's team was told to track: once all of it had taken off."""
    return flight["tracking_since_s"] is not None


def _deaf(spells: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """Return the number of spells without commands to a drone, and its distance and speed in them: median and most."""
    figures: dict[str, Any] = {"spells": len(spells)}
    for key in ("flown_m", "fastest_m_s") if spells else ():
        values = [spell[key] for spell in spells]
        figures |= {f"{key}_median": round(statistics.median(values), 3), f"{key}_most": max(values)}
    return figures


def ends_told(summary: Mapping[str, Any]) -> list[str]:
    """Return the campaign's result as lines of text; summary: of `totals`."""
    lines = [
        f"{summary['unsafe']} of {summary['flights']} flights ended unsafe; healthy flights stopped: "
        f"{summary['false_alarms'] or 'none'}; did not all take off: {summary['not_flown'] or 'none'}"
    ]
    if unjudged := summary["stops_due"] - summary["stops_judged"]:
        lines.append(
            f"  {unjudged} of {summary['stops_due']} faults that demand a stop were not judged by it: they never "
            "showed, or not for long enough"
        )
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
    heads = ("fault", "flights", "unsafe", "alone", "sep m", "fence m", "m/s", "lost s", "stops judged",
             "hover s", "rest s")  # fmt: skip
    columns = "{:18s} {:>7s} {:>6s} {:>7s} {:>6s} {:>7s} {:>5s} {:>6s} {:>12s} {:>7s} {:>6s}"
    head = columns.format(*heads)
    lines = [f"{head}  first broken; seeds"]
    for row in rows:
        figures = [f"{row[key]:.2f}" if row[key] is not None else "-" for key, _ in _WORST]
        alone = f"{row['unsafe_alone']}/{row['alone']}"
        stops = f"{row['stops_judged']}/{row['stops_due']}" if row["stops_due"] else "-"
        why = ", ".join(f"{what} {count}" for what, count in row["why"].items())
        seeds = " ".join(map(str, row["seeds"][:_SHOWN_SEEDS])) + (" ..." if len(row["seeds"]) > _SHOWN_SEEDS else "")
        counts = (row["kind"], str(row["flights"]), str(row["unsafe"]), alone)
        line = columns.format(*counts, *figures[:-2], stops, *figures[-2:])
        lines.append(f"{line}  {why}; {seeds}" if why else f"{line}  ")
    return lines
