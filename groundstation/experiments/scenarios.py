"""Scenarios flown under strategies: their figures over seeds, and paired differences between strategies."""

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from groundstation.estimation.mean_interval import half_width

STRATEGIES = (
    "ours", "string", "reversed", "flat", "two-level", "no-topology", "relay", "chase", "sampling", "lattice",
    "first-program",
)  # fmt: skip
FIXED = ("string", "reversed", "flat", "two-level")
_SUMS = ("landings", "switches")


def rows_of(flights: Iterable[Mapping[str, Any]]) -> list[dict[str, Any]]:
    """Return a row for each scenario and strategy, in their order: flights, those as expected, then figures.

    never_found: flights that never found the target, not_flown: those whose team did not all take off.
    rmse_m: mean, median, worst over the flights that found the target; lost_s: mean; longest_s, found_s: worst;
    plan_ms: median time of a plan by the wall clock, in which nothing else of the flight goes on.
    against: how much larger the rmse is than that of the first strategy for the same seeds, mean and half width of the
    95 % interval [m]; None with fewer than two seeds.
    """
    groups: dict[tuple[str, str], list[Mapping[str, Any]]] = {}
    for flight in flights:
        groups.setdefault((flight["scenario"], flight["strategy"]), []).append(flight)
    first: dict[str, list[Mapping[str, Any]]] = {}
    rows = []
    for (scenario, strategy), own in groups.items():
        reference = first.setdefault(scenario, own)
        against = None if reference is own else paired(own, reference)
        rows.append({"scenario": scenario, "strategy": strategy, **_figures(own), "against": against})
    return rows


def _figures(flights: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    found = [one for one in flights if one.get("rmse_m") is not None]
    errors = [one["rmse_m"] for one in found]
    not_flown = sum(not one["flown"] for one in flights)
    return {
        "flights": len(flights),
        "as_expected": sum(not one["missed"] for one in flights),
        "never_found": len(flights) - len(found) - not_flown,
        "not_flown": not_flown,
        "rmse_m": [float(pick(errors)) for pick in (np.mean, np.median, np.max)] if errors else None,
        "lost_s": float(np.mean([one["lost_s"] for one in found])) if found else None,
        "longest_s": max((one["longest_loss_s"] for one in found), default=None),
        "found_s": max((one["found_s"] for one in found), default=None),
        **{key: sum(one.get(key, 0) for one in flights) for key in _SUMS},
        "violations": sum(bool(one.get("violations")) for one in flights),
        "plan_ms": float(np.median([one["plan_ms"] for one in flights])),
        "missed": {one["seed"]: one["missed"] for one in flights if one["missed"]},
    }


def paired(own: Iterable[Mapping[str, Any]], other: Iterable[Mapping[str, Any]]) -> tuple[float, float] | None:
    """Return mean and half width of the 95 % interval of own rmse minus the other's over the seeds that both found."""
    known = {one["seed"]: one["rmse_m"] for one in other if one.get("rmse_m") is not None}
    gaps = [one["rmse_m"] - known[one["seed"]] for one in own if one["seed"] in known and one.get("rmse_m") is not None]
    return (float(np.mean(gaps)), half_width(gaps)) if len(gaps) > 1 else None


def against_best_fixed(flights: Iterable[Mapping[str, Any]]) -> list[dict[str, Any]]:
    """Return the comparison of each other strategy with the best fixed topology of its scenario.

    Best: it found the target in most seeds, then has the least mean rmse over those of all that did; chosen afterwards,
    which favours it. Entries: scenario, strategy, best, found (of own flights and of the best's, in how many, of how
    many), seeds (number in which both found it), share (mean rmse over that of the best, less 1, over these; None
    without any), gap_m (mean difference and half width of its 95 % interval; None with fewer than two).
    """
    errors: dict[str, dict[str, dict[int, float]]] = {}
    flown: Counter[tuple[str, str]] = Counter()
    for one in flights:
        own = errors.setdefault(one["scenario"], {}).setdefault(one["strategy"], {})
        flown[one["scenario"], one["strategy"]] += 1
        if one.get("rmse_m") is not None:
            own[one["seed"]] = one["rmse_m"]
    entries: list[dict[str, Any]] = []
    for scenario, known in errors.items():
        if not (fixed := {name: own for name, own in known.items() if name in FIXED and own}):
            continue
        best = _best(fixed)
        for strategy, own in known.items():
            shared = sorted(own.keys() & known[best].keys())
            if strategy in FIXED:
                continue
            share = _mean(own, shared) / _mean(known[best], shared) - 1.0 if shared else None
            entries.append(
                {
                    "scenario": scenario,
                    "strategy": strategy,
                    "best": best,
                    "found": [(len(known[name]), flown[scenario, name]) for name in (strategy, best)],
                    "seeds": len(shared),
                    "share": share,
                    "gap_m": paired(_as_flights(own), _as_flights(known[best])),
                }
            )
    return entries


def _mean(errors: Mapping[int, float], seeds: Iterable[int]) -> float:
    return float(np.mean([errors[seed] for seed in seeds]))


def _best(errors: Mapping[str, Mapping[int, float]]) -> str:
    """Return the best of some strategies by their rmse in the seeds that found the target."""
    most = max(map(len, errors.values()))
    leading = {name: own for name, own in errors.items() if len(own) == most}
    shared = frozenset.intersection(*map(frozenset, leading.values()))
    return min(leading, key=lambda name: _mean(leading[name], shared or leading[name]))


def _as_flights(errors: Mapping[int, float]) -> list[dict[str, float]]:
    return [{"seed": seed, "rmse_m": error} for seed, error in errors.items()]


def comparison(entries: Iterable[Mapping[str, Any]]) -> list[str]:
    """Return the entries of `against_best_fixed` as lines of text."""
    lines = []
    for one in entries:
        interval = "" if one["gap_m"] is None else " ({:+.3f} +- {:.3f} m)".format(*one["gap_m"])
        over = f" over {one['seeds']} seed{'s' * (one['seeds'] > 1)}" if one["seeds"] else ""
        share = "no seed that both found" if one["share"] is None else f"{one['share']:+.0%}"
        found = ", ".join(f"{count}/{flights}" for count, flights in one["found"])
        against = f"{share} against {one['best']}{interval}{over}"
        lines.append(f"{one['scenario']} {one['strategy']}: {against} (found {found})")
    return lines


def table(rows: Sequence[Mapping[str, Any]]) -> list[str]:
    """Return the rows as lines of text."""
    head = (
        "scenario",
        "strategy",
        "ok",
        "never",
        "ground",
        "mean m",
        "median",
        "worst",
        "lost s",
        "longest",
        "found s",
        "land",
        "viol",
        "switch",
        "plan ms",
    )
    layout = "{:17s} {:13s} {:>6s} {:>5s} {:>6s} {:>7s} {:>7s} {:>7s} {:>7s} {:>7s} {:>7s} {:>4s} {:>4s} {:>6s} {:>7s}"
    lines = [layout.format(*head) + "  against the first [m]"]
    for row in rows:
        errors = [f"{value:.3f}" for value in row["rmse_m"] or ()] or ["-"] * 3
        seconds = ["-" if row[key] is None else f"{row[key]:.1f}" for key in ("lost_s", "longest_s", "found_s")]
        counts = [str(row[key]) for key in ("landings", "violations", "switches")] + [f"{row['plan_ms']:.1f}"]
        against = "" if row["against"] is None else "{:+.3f} +- {:.3f}".format(*row["against"])
        share = f"{row['as_expected']}/{row['flights']}"
        never = str(row["never_found"]), str(row["not_flown"])
        cells = layout.format(row["scenario"], row["strategy"], share, *never, *errors, *seconds, *counts)
        lines.append(f"{cells}  {against}".rstrip())
    return lines
