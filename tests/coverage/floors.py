"""Compares the coverage of runs with a floor for each package: `python floors.py DATA... [--raise]`.

The measurement counts the statements of functions that Python runs, in every module of the product, imported or not.
`--raise` moves the floors up to the measured values; nothing here lowers one.
"""

import ast
import os
import sys
import tomllib
from pathlib import Path
from typing import NamedTuple

from block_probes import put_probes
from measurement import Measured
from probing_importer import MEASURED

ROOT = Path(__file__).parents[2]
FLOORS = Path(__file__).with_name("floors.toml")
# Variation between runs: threads, time-outs, random examples [percent].
PLAY = 3


class Count(NamedTuple):
    """Number of statements that ran, and of all."""

    run: int = 0
    all: int = 0

    @property
    def percent(self) -> float:
        """Return the share that ran; 100 for no statements."""
        return 100.0 * self.run / self.all if self.all else 100.0


def package_of(module: Path) -> str:
    """Return the package under which a module (relative path) is counted: the top one's child, else the top itself."""
    return ".".join(module.parts[:2] if len(module.parts) > 2 else module.parts[:1])


def counts(root: Path, measured: Measured) -> dict[str, Count]:
    """Return the count of each package of a tree."""
    result: dict[str, Count] = {}
    for path in sorted(each for top in MEASURED for each in (root / top).rglob("*.py")):
        statements = put_probes(ast.parse(path.read_bytes())).statements
        hits = measured.hits.get(str(path), b"")
        if len(hits) != len(statements):
            hits = bytes(len(statements))  # never imported, or changed since
        name = package_of(path.relative_to(root))
        before = result.get(name, Count())
        run = sum(number for number, hit in zip(statements, hits, strict=True) if hit)
        result[name] = Count(before.run + run, before.all + sum(statements))
    return {name: count for name, count in result.items() if count.all}


def faults(found: dict[str, Count], floors: dict[str, int]) -> list[str]:
    """Return one sentence for each package below its floor, without a floor, or with a floor and gone."""
    low = [
        f"{name}: {count.percent:.1f} % of its statements run, its floor is {floors[name]} %: test what you added"
        for name, count in found.items()
        if count.percent < floors.get(name, 0)
    ]
    new = [f"{name}: has no floor yet; add {_floor(found[name])} to {FLOORS.name}" for name in found.keys() - floors]
    gone = [f"{name}: is gone; remove its floor from {FLOORS.name}" for name in floors.keys() - found]
    return low + sorted(new) + sorted(gone)


def raised(found: dict[str, Count], floors: dict[str, int]) -> dict[str, int]:
    """Return the floors for the measured values, none lower than before."""
    return {name: max(floors.get(name, 0), _floor(count)) for name, count in sorted(found.items())}


def _floor(count: Count) -> int:
    return max(0, int(count.percent) - PLAY)


def _write(floors: dict[str, int]) -> None:
    head = "# The least share of each package's statements that `make test` runs [percent]. Only ever raised.\n"
    text = "".join(f'"{name}" = {floor}\n' for name, floor in floors.items())
    FLOORS.write_text(head + text, encoding="utf-8")


def main(arguments: list[str]) -> int:
    """Print the counts beside their floors; return 1 if one is below."""
    measured = Measured.joined(Measured.read(Path(each)) for each in arguments if each != "--raise")
    found = counts(ROOT, measured)
    floors = tomllib.loads(FLOORS.read_text(encoding="utf-8")) if FLOORS.exists() else {}
    if "--raise" in arguments:
        _write(raised(found, floors))
        return 0
    for name, count in found.items():
        print(f"{name:34} {count.percent:5.1f} % of {count.all:5}, floor {floors.get(name, 0):3}")
    if measured.skipped and "CI" not in os.environ:
        print(f"coverage: not judged, because {measured.skipped} tests were skipped")
        return 0
    wrong = faults(found, floors)
    print("\n".join(f"coverage: {each}" for each in wrong) or "coverage: no package is below its floor")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
