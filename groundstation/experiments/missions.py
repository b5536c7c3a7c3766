"""Results of healthy missions in random rooms, and their table."""

from collections.abc import Mapping, Sequence
from typing import Any

from groundstation.experiments.summary import worst

_WORST = (("separation_m", min), ("fence_m", max), ("unlocalised_s", max))
_SHOWN_SEEDS = 8


def rows_of(flights: Sequence[Mapping[str, Any]]) -> list[dict[str, Any]]:
    """Return one row for flights with correct covariances of sightings, and one for those with understated ones.

    flights: number flown; violations: seeds that left the fence or came too close, with the time [s];
    landed_before: seeds in which a drone landed without the order; standing: seeds in which one still flew at the end.
    """
    rows = []
    for share in sorted({flight["covariance_share"] for flight in flights}, reverse=True):
        mine = [flight for flight in flights if flight["covariance_share"] == share]
        flown = [flight for flight in mine if flight["flown"]]
        rows.append(
            {
                "covariance_share": share,
                "flights": len(flown),
                "not_flown": [flight["seed"] for flight in mine if not flight["flown"]],
                **{key: worst(flown, key, pick) for key, pick in _WORST},
                "violations": {flight["seed"]: broken for flight in flown if (broken := _broken(flight))},
                "landed_before": [flight["seed"] for flight in flown if flight["landed_before"]],
                "not_landed": [flight["seed"] for flight in flown if not flight["landed"]],
            }
        )
    return rows


def _broken(flight: Mapping[str, Any]) -> dict[str, float]:
    return {what: at_s for what, at_s in flight["unsafe"].items() if what in ("fence", "separation")}


def table(rows: Sequence[Mapping[str, Any]]) -> list[str]:
    """Return the rows as lines of text."""
    columns = "{:>10s} {:>7s} {:>10s} {:>6s} {:>8s} {:>7s} {:>6s} {:>8s}  {}"
    lines = [
        columns.format(
            "covariance", "flights", "violations", "sep m", "fence m", "lost s", "landed", "airborne", "seeds"
        )
    ]
    for row in rows:
        figures = ["-" if row[key] is None else f"{row[key]:.2f}" for key, _ in _WORST]
        seeds = " ".join(map(str, [*row["violations"], *row["not_flown"]][:_SHOWN_SEEDS]))
        counts = [str(len(row[key])) for key in ("landed_before", "not_landed")]
        share, violations = f"{row['covariance_share']:.2f}", str(len(row["violations"]))
        lines.append(columns.format(share, str(row["flights"]), violations, *figures, *counts, seeds).rstrip())
    return lines
