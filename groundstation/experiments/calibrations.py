"""Judges whether `calibrate team` mends wrong field files, by the errors that remain with its settings. Pure."""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from groundstation.experiments.culprit_rows import WrongLab

RMSE_M, ANEES = 0.04, (0.5, 2.0)
BARS = {"turn": 0.3, "place": 0.01, "focal": 0.005, "print": 0.005, "delay": 5.0}
"""Permitted remaining errors: deg, m, shares, ms."""
_UNITS = {"turn": (1.0, "deg"), "place": (100.0, "cm"), "delay": (1.0, "ms")}
_PERCENT = (100.0, "%")
_KINDS = dict.fromkeys(("roll", "pitch", "yaw", "pan", "tilt"), "turn") | dict.fromkeys(
    ("x", "y", "z", "ahead", "left", "up"), "place"
)


def calibrated_labs(labs: Iterable[WrongLab]) -> list[WrongLab]:
    """Return the rows in which only the field file is wrong, in other figures than pads, and the healthy one."""
    own = [lab for lab in labs if lab.errors and not lab.exchanged and not lab.faults]
    kept = [lab for lab in own if not any(part.startswith("pad") for _, part, _ in lab.errors)]
    return [WrongLab("nothing"), *kept]


def verdict_on(lab: WrongLab, before: Mapping[str, Any], after: Mapping[str, Any]) -> dict[str, Any]:
    """Return the verdict on one flight and its settings.

    left: remaining error of each wrong figure, by "WHO KIND"; missed: those beyond their limits; mended: whether
    the same flight with the new settings keeps the limits of rmse and ANEES.
    """
    wrong = dict.fromkeys((who, _KINDS.get(part, part)) for who, part, _ in lab.errors)
    left = {f"{who} {kind}": after["left"][who][kind] for who, kind in wrong}
    missed = [name for name, value in left.items() if abs(value) > BARS[name.rsplit(" ", 1)[1]]]
    rmse, anees = after.get("rmse_m"), after.get("anees")
    return {
        "seed": before["seed"],
        "settings": before["settings"],
        "left": left,
        "missed": missed,
        "rmse_m": [before.get("rmse_m"), rmse],
        "anees": [before.get("anees"), anees],
        "mended": rmse is not None and anees is not None and rmse <= RMSE_M and ANEES[0] <= anees <= ANEES[1],
    }


def row_of(lab: WrongLab, verdicts: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """Return one row of the table."""
    return {
        "lab": lab.name,
        "flights": len(verdicts),
        "mended": sum(one["mended"] for one in verdicts),
        "within_bars": sum(not one["missed"] for one in verdicts),
        "worst_left": _worst([one["left"] for one in verdicts]),
        "rmse_m": [_most([one["rmse_m"][i] for one in verdicts]) for i in (0, 1)],
        "anees": [_most([one["anees"][i] for one in verdicts]) for i in (0, 1)],
    }


def _worst(left: Sequence[Mapping[str, float]]) -> dict[str, float]:
    return {name: max((one[name] for one in left), key=abs) for name in (left[0] if left else ())}


def _most(values: Sequence[float | None]) -> float | None:
    """Return the worst of some figures: None if a flight has none, as one that never found its target."""
    known = [value for value in values if value is not None]
    return max(known) if known and len(known) == len(values) else None


def table(rows: Iterable[Mapping[str, Any]]) -> list[str]:
    """Return the rows as lines of text; rmse and ANEES: the worst flight before and after.

    never: one of its flights never found the target.
    """
    lines = ["{:20s} {:>7s} {:>7s} {:>17s} {:>13s}  worst left".format("wrong", "mended", "within", "rmse m", "ANEES")]
    for row in rows:
        flights, (rmse, rmse_now), (anees, anees_now) = row["flights"], row["rmse_m"], row["anees"]
        left = ", ".join(_told(name, value) for name, value in row["worst_left"].items())
        lines.append(
            f"{row['lab']:20s} {row['mended']}/{flights:<5d} {row['within_bars']}/{flights:<5d} "
            f"{_figure(rmse, 3)} -> {_figure(rmse_now, 3)} {_figure(anees, 1)} -> {_figure(anees_now, 1)}  {left}"
        )
    return lines


def _told(name: str, value: float) -> str:
    factor, unit = _UNITS.get(name.rsplit(" ", 1)[1], _PERCENT)
    return f"{name} {factor * value:.2f} {unit}"


def _figure(value: float | None, digits: int) -> str:
    return "never" if value is None else f"{value:.{digits}f}"
