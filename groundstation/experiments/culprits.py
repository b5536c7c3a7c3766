"""Judges whether the right culprit is accused in flights of wrong labs; verdicts and their table. Pure."""

import math
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from groundstation.experiments.culprit_rows import WrongLab, size_told

WITHIN_S = 20.0
SIZE_SHARE = 0.25
# Texts that accuse an entity; other warnings report consequences.
_FIGURE = "explains best"
_ACCUSES = (_FIGURE, "no single wrong figure", "contradicts the belief", "its pictures seem", "was bumped")
_EXCUSED = "probably not its fault"
_REFUTED = "no longer suspected"


def accusations(flight: Mapping[str, Any]) -> list[tuple[float, str]]:
    """Return the accusations as (seconds after the order to take off, "SUBJECT: TEXT"); 0 s: on the pads."""
    found = [(0.0, line) for _, line in flight["on_pads"] or ()]
    for at_s, severity, entity, text, remedy in flight["told"]:
        accused = any(words in text for words in _ACCUSES) and not remedy.startswith(_EXCUSED)
        if accused and severity in ("WARNING", "ERROR"):
            found.append((at_s, f"{entity}: {text}"))
    return found


def verdict_on(lab: WrongLab, flight: Mapping[str, Any]) -> dict[str, Any]:
    """Return the verdict on one flight.

    end: "refused" (rightly, before the take-off), "right" (reported in flight, in time), "late", "wrong" (another one
    was accused, or this one before it was wrong), "silent"; of a healthy lab "silent" or "false alarm"; of any lab
    whose team did not all take off, though nothing was rightly refused, "not flown".
    size_error: relative error of the reported size; said: the first accusation, after the right one the first of
    another.
    """
    said, on_pads = accusations(flight), flight["on_pads"]
    first = said[0] if said else None
    size = None if first is None else size_told(lab, first[1])
    refused = bool(on_pads) and on_pads[0][0] == "MUST"
    end, other = _end(lab, first, size, refused), None
    if end in ("right", "late"):
        other = next((line for _, line in said if _names_another(lab, line, said[0][1])), None)
        end = end if other is None else "wrong"
    if not flight["flown"] and end != "refused":
        end = "not flown"
    return {
        "seed": flight["seed"],
        "end": end,
        "at_s": None if first is None else first[0],
        "size_error": None if size is None or not lab.size or math.isnan(size) else abs(size / lab.size - 1.0),
        "refuted": any(_REFUTED in text for _, _, _, text, _ in flight["told"]),
        "rmse_m": flight.get("rmse_m"),
        "said": other or ("" if first is None else first[1]),
    }


def _names_another(lab: WrongLab, line: str, right: str) -> bool:
    """Return whether an accusation names another culprit, or another wrong figure of the same."""
    if size_told(lab, line) is not None:
        return False
    return _FIGURE in line or line.split(": ")[0] != right.split(": ")[0]


def _end(lab: WrongLab, first: tuple[float, str] | None, size: float | None, refused: bool) -> str:
    if first is None:
        return "silent"
    if not lab.says:
        return "false alarm"
    if size is None or first[0] < lab.since_s:
        return "wrong"
    if refused:
        return "refused"
    return "right" if first[0] - lab.since_s <= WITHIN_S else "late"


def needed_s(lab: WrongLab) -> float:
    """Return for how long a flight must track at least for its verdict [s]; tracking begins after the order."""
    return lab.since_s + WITHIN_S


def row_of(lab: WrongLab, verdicts: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """Return one row of the table: number of flights by end, latest time, median size error, rmse."""
    ends = [one["end"] for one in verdicts]
    good = [one for one in verdicts if one["end"] in ("refused", "right")]
    errors = sorted(one["size_error"] for one in good if one["size_error"] is not None)
    tracked = [one["rmse_m"] for one in verdicts if one["rmse_m"] is not None]
    return {
        "lab": lab.name,
        "flights": len(verdicts),
        "ends": {end: ends.count(end) for end in dict.fromkeys(ends)},
        "as_wanted": _as_wanted(lab, ends),
        "latest_s": max((one["at_s"] for one in good), default=None),
        "size_ok": sum(error <= SIZE_SHARE for error in errors) if errors else None,
        "sizes": len(errors),
        "rmse_m": sum(tracked) / len(tracked) if tracked else None,
        "otherwise": {one["seed"]: one["said"] for one in verdicts if one["end"] in ("wrong", "false alarm", "late")},
    }


def _as_wanted(lab: WrongLab, ends: Sequence[str]) -> int:
    if not lab.says:
        return ends.count("silent")
    return ends.count("refused") + (0 if lab.on_pads else ends.count("right"))


def table(rows: Iterable[Mapping[str, Any]]) -> list[str]:
    """Return the rows as lines of text, below each its other accusations."""
    head = ("wrong", "as wanted", "latest", "size", "rmse")
    lines = ["{:27s} {:>9s} {:>8s} {:>6s} {:>8s}  ends".format(*head)]
    for row in rows:
        latest = "-" if row["latest_s"] is None else f"{row['latest_s']:.1f} s"
        size = "-" if row["size_ok"] is None else f"{row['size_ok']}/{row['sizes']}"
        rmse = "-" if row["rmse_m"] is None else f"{row['rmse_m']:.3f} m"
        ends = ", ".join(f"{end} {count}" for end, count in row["ends"].items())
        wanted = f"{row['as_wanted']}/{row['flights']}"
        lines.append(f"{row['lab']:27s} {wanted:>9s} {latest:>8s} {size:>6s} {rmse:>8s}  {ends}")
        lines += [f"    seed {seed}: {said[:150]}" for seed, said in row["otherwise"].items()]
    return lines
