"""Results of healthy missions in random rooms, and their table."""

from collections.abc import Mapping, Sequence
from typing import Any

from groundstation.experiments.summary import worst

_WORST = (("separation_m", min), ("fence_m", max), ("obstacle_m", min), ("unlocalised_s", max))
_BOUNDS = ("fence", "obstacle", "separation", "fell")
_SHOWN_SEEDS = 8


def rows_of(flights: Sequence[Mapping[str, Any]]) -> list[dict[str, Any]]:
    """Return a row each for flights in which nothing is wrong, sightings state too little, or velocities are off.

    flights: number that tracked; not_flown: seeds whose team did not all take off; drones: sizes of the teams that
    tracked; violations: seeds that left the fence, came too near to each other or an obstacle, or fell, with the time
    [s]; landed_before: seeds in which a drone came down without the order; not_landed: seeds in which one still
    flew at the end.
    """
    rows = []
    for share, drift_m_s in sorted({_wrong(flight) for flight in flights}, key=lambda wrong: (-wrong[0], wrong[1])):
        mine = [flight for flight in flights if _wrong(flight) == (share, drift_m_s)]
        judged = [flight for flight in mine if "unsafe" in flight]
        flown = [flight for flight in mine if flight["flown"]]
        rows.append(
            {
                "covariance_share": share,
                "drift_m_s": drift_m_s,
                "drones": sorted({flight["drones"] for flight in flown}),
                "flights": len(flown),
                "not_flown": [flight["seed"] for flight in mine if not flight["flown"]],
                **{key: worst(judged, key, pick) for key, pick in _WORST},
                "violations": {flight["seed"]: broken for flight in judged if (broken := _broken(flight))},
                "landed_before": [flight["seed"] for flight in flown if flight["landed_before"]],
                "not_landed": [flight["seed"] for flight in flown if not flight["landed"]],
            }
        )
    return rows


def _wrong(flight: Mapping[str, Any]) -> tuple[float, float]:
    return flight["covariance_share"], flight["drift_m_s"]


def _broken(flight: Mapping[str, Any]) -> dict[str, float]:
    return {what: at_s for what, at_s in flight["unsafe"].items() if what in _BOUNDS}


def table(rows: Sequence[Mapping[str, Any]]) -> list[str]:
    """Return the rows as lines of text."""
    columns = "{:>10s} {:>9s} {:>7s} {:>10s} {:>6s} {:>8s} {:>6s} {:>7s} {:>6s} {:>8s}  {}"
    heads = ("flights", "violations", "sep m", "fence m", "box m", "lost s", "landed", "airborne", "seeds")
    lines = [columns.format("covariance", "drift m/s", *heads)]
    for row in rows:
        figures = ["-" if row[key] is None else f"{row[key]:.2f}" for key, _ in _WORST]
        seeds = " ".join(map(str, [*row["violations"], *row["not_flown"]][:_SHOWN_SEEDS]))
        counts = [str(len(row[key])) for key in ("landed_before", "not_landed")]
        wrong = [f"{row[key]:.2f}" for key in ("covariance_share", "drift_m_s")]
        violations = str(len(row["violations"]))
        lines.append(columns.format(*wrong, str(row["flights"]), violations, *figures, *counts, seeds).rstrip())
    return lines
