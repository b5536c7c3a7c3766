"""`python -m sim_bridge.study vision`: measures markers and detector, judges the figures, writes tables and plots."""

import argparse
import json
import math
import sys
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from drivers.camera.search import search
from groundstation.geometry.board import VALID_CODES
from sim_bridge.study.vision.load import team_load
from sim_bridge.study.vision.measure import DetectionTally, cpu_ms, measured, peer_search
from sim_bridge.study.vision.scenes import CONDITIONS, Condition, shots

RANGES_M = (1.0, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0)
STEEPNESS_DEG = ((15.0, 30.0), (30.0, 45.0), (45.0, 60.0), (60.0, 70.0), (70.0, 80.0))
_CLEAN, _REAL = CONDITIONS[0], CONDITIONS[1]
_CONDITION_RANGES_M = (1.0, 2.0, 3.0, 4.0)
_STEEPNESS_RANGE_M = 1.5

Row = dict[str, Any]


def run(pictures: int, seed: int, tell: Callable[[str], object]) -> dict[str, Any]:
    """Return all figures; pictures: number of them for each cell of the tables."""
    cv2.setNumThreads(1)
    result: dict[str, Any] = {"pictures": pictures, "seed": seed}
    for name, condition in (("clean", _CLEAN), ("realistic", _REAL)):
        tell(f"distances, {name}")
        result[name] = [_at(range_m, condition, pictures, seed) for range_m in RANGES_M]
    tell("steepness")
    result["steepness"] = [
        {"steepness_deg": list(steep)}
        | measured(shots(pictures, _STEEPNESS_RANGE_M, _CLEAN, seed, steepness_deg=steep), seed, searching=False).row()
        for steep in STEEPNESS_DEG
    ]
    result["conditions"] = []
    for condition in CONDITIONS:
        tell(condition.name)
        for range_m in _CONDITION_RANGES_M:
            row = _at(range_m, condition, max(10, pictures // 2), seed + 1, searching=False)
            result["conditions"].append({"condition": condition.name, **row})
    tell("identities and flips")
    result["identities"] = _identities(max(100, 8 * pictures), seed)
    result["flips"] = [_flips(range_m, max(50, 4 * pictures), seed) for range_m in (1.0, 2.0, 3.0, 4.0)]
    tell("peer")
    result["peer"] = _peer(pictures, seed)
    tell("a team's cameras")
    result["team"] = team_load(max(2.0, pictures / 6.0))
    result["targets"] = targets(result)
    return result


def _at(range_m: float, condition: Condition, pictures: int, seed: int, searching: bool = True) -> Row:
    tally = measured(shots(pictures, range_m, condition, seed), seed, searching)
    return {"range_m": range_m, **tally.row()}


def _identities(readings: int, seed: int) -> Row:
    """Return the numbers of bars (all codes, from 1 to 4 m), of certain readings, and of wrong ones."""
    total = DetectionTally()
    for range_m in (1.0, 2.0, 3.0, 4.0):
        tally = measured(shots(readings // 4, range_m, _REAL, seed + 2, VALID_CODES), seed, searching=False)
        total.pictures += tally.pictures
        total.sure += tally.sure
        total.wrong_ids += tally.wrong_ids
    return {"pictures": total.pictures, "sure": total.sure, "wrong": total.wrong_ids}


def _flips(range_m: float, pictures: int, seed: int) -> Row:
    tally = measured(shots(pictures, range_m, _REAL, seed + 3), seed, searching=False)
    return {"range_m": range_m, "sightings": tally.followed, "flips": tally.flips}


def _peer(pictures: int, seed: int) -> Row:
    """Return detection and CPU of searching whole pictures: ours, and OpenCV's sector-based finder, alternating."""
    found = {"ours": 0, "peer": 0}
    spent: dict[str, list[float]] = {"ours": [], "peer": []}
    count = 0
    for range_m in (1.0, 2.0, 3.0, 4.0):
        for shot in shots(max(8, pictures // 4), range_m, _CLEAN, seed + 4):
            count += 1
            ms, finds = cpu_ms(partial(search, shot.picture, []))
            spent["ours"].append(ms)
            found["ours"] += any(float(np.abs(find.corners - shot.corners).max()) < 3.0 for find in finds)
            ms, seen = cpu_ms(partial(peer_search, shot))
            spent["peer"].append(ms)
            found["peer"] += seen
    medians = {name: float(np.median(ms)) for name, ms in spent.items()}
    return {
        "pictures": count,
        **{f"{name}_found": n / count for name, n in found.items()},
        **{f"{name}_ms": ms for name, ms in medians.items()},
        "cpu_ratio": medians["peer"] / medians["ours"],
    }


def targets(result: dict[str, Any]) -> list[Row]:
    """Return each required figure (640x360, f 460 px), whether it is met, and its value."""
    clean, real = ({row["range_m"]: row for row in result[name]} for name in ("clean", "realistic"))
    near = [row for r, row in clean.items() if r <= 4.0]
    anees = {name: _mean_anees(rows) for name, rows in (("clean", clean), ("realistic", real))}
    wanted: list[tuple[str, float, str, float]] = [
        ("found with prediction to 4 m", min(row["followed"] for row in near), ">=", 0.95),
        ("found by searching to 2.5 m", min(clean[r]["searched"] for r in (1.0, 1.5, 2.0, 2.5)), ">=", 0.85),
        ("range error at 2 m, median mm", clean[2.0]["range_error_median_mm"], "<=", 1.5),
        ("range error at 3 m, median mm", clean[3.0]["range_error_median_mm"], "<=", 5.0),
        ("heading error at 2 m, median deg", clean[2.0]["heading_error_median_deg"], "<=", 0.2),
        ("ANEES/6 clean, least", anees["clean"], ">=", 0.6),
        ("ANEES/6 clean, most", anees["clean"], "<=", 1.5),
        ("ANEES/6 with 0.2 px, least", anees["realistic"], ">=", 0.6),
        ("ANEES/6 with 0.2 px, most", anees["realistic"], "<=", 1.5),
        ("wrong identities", result["identities"]["wrong"], "<=", 0),
        ("planar flips after gravity", sum(row["flips"] for row in result["flips"]), "<=", 0),
        ("CPU of a predicted window, median ms", float(np.median([row["window_ms"] for row in near])), "<=", 1.0),
        ("CPU of a full search, median ms", float(np.median([row["search_ms"] for row in near])), "<=", 35.0),
        ("cores for 3 drones and a ceiling at 15 fps", result["team"]["cores"], "<=", 1.2),
    ]
    return [
        {"name": name, "value": value, "relation": relation, "limit": limit, "ok": _holds(value, relation, limit)}
        for name, value, relation, limit in wanted
    ]


def _mean_anees(rows: dict[float, Row]) -> float:
    return float(np.mean([row["anees_6"] for r, row in rows.items() if r <= 3.0]))


def _holds(value: float, relation: str, limit: float) -> bool:
    return math.isfinite(value) and (value >= limit if relation == ">=" else value <= limit)


def main(arguments: list[str]) -> int:
    """Run the bench; exit code 0 when every required figure is met, 1 otherwise."""
    from sim_bridge.study.vision.page import page_of, plot

    parser = argparse.ArgumentParser(prog="python -m sim_bridge.study vision", description=__doc__)
    parser.add_argument("--pictures", type=int, default=60, help="pictures per cell of the tables (default: 60)")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("-o", "--output", dest="out", type=Path, help="folder for vision.json and plots")
    parser.add_argument("--json", action="store_true", help="print all figures as JSON")
    options = parser.parse_args(arguments)
    if options.pictures < 8:
        parser.error(f"--pictures {options.pictures}: at least 8 per cell, else nothing can be said")

    def tell(text: str) -> None:
        if sys.stderr.isatty():
            print(f"\r\033[K{text}", end="", file=sys.stderr, flush=True)

    result = run(options.pictures, options.seed, tell)
    tell("")
    if options.out is not None:
        options.out.mkdir(parents=True, exist_ok=True)
        (options.out / "vision.json").write_text(json.dumps(result, indent=1), encoding="utf-8")
        plot(result, options.out)
    print(json.dumps(result, indent=1) if options.json else page_of(result), flush=True)
    return 0 if all(target["ok"] for target in result["targets"]) else 1
