"""Measures the statements that one run of pytest executes, where `COVERAGE_DATA` names its file (make test)."""

import json
import os
import sys
from collections.abc import Iterable
from pathlib import Path
from typing import NamedTuple, Self

from probing_importer import ProbingFinder

VARIABLE = "COVERAGE_DATA"


class Measured(NamedTuple):
    """The probes hit, by file, and how many tests were skipped."""

    hits: dict[str, bytes]
    skipped: int = 0

    def write(self, path: Path) -> None:
        """Write the measurement as JSON."""
        path.parent.mkdir(parents=True, exist_ok=True)
        data = {"hits": {name: each.hex() for name, each in self.hits.items()}, "skipped": self.skipped}
        path.write_text(json.dumps(data), encoding="utf-8")

    @classmethod
    def read(cls, path: Path) -> Self:
        """Read a measurement from the file of `write`."""
        data = json.loads(path.read_text(encoding="utf-8"))
        return cls({name: bytes.fromhex(each) for name, each in data["hits"].items()}, data["skipped"])

    @classmethod
    def joined(cls, parts: Iterable[Self]) -> Self:
        """Return the joint measurement of runs of different tests."""
        hits: dict[str, bytes] = {}
        skipped = 0
        for part in parts:
            hits = _either(hits, part.hits)
            skipped += part.skipped
        return cls(hits, skipped)

    def with_repeated(self, again: "Measured") -> "Measured":
        """Add a run that repeated some of the tests; a file changed since counts as in the later run."""
        return Measured(_either(self.hits, again.hits), self.skipped)


def _either(first: dict[str, bytes], second: dict[str, bytes]) -> dict[str, bytes]:
    """Return the probes that one of two runs hit; where a file has changed between them, those of the second."""
    hits = dict(first)
    for name, each in second.items():
        before = hits.get(name, b"")
        same = len(before) == len(each)
        hits[name] = bytes(a | b for a, b in zip(before, each, strict=True)) if same else each
    return hits


class Measurement:
    """Measurement of one run; it must start before the first import of a measured module."""

    def __init__(self) -> None:
        # Removed from the environment: a pytest started by a test must not write the same file.
        self._path = os.environ.pop(VARIABLE, "")
        self._finder = ProbingFinder()
        if self._path:
            sys.meta_path.insert(0, self._finder)

    def finish(self, skipped: int, repeated: bool) -> None:
        """Write the run's hits, or add them to the file if the run repeated a part of an earlier one."""
        if not self._path:
            return
        path = Path(self._path)
        measured = Measured({name: bytes(each) for name, each in self._finder.hits.items()}, skipped)
        if repeated and path.exists():
            measured = Measured.read(path).with_repeated(measured)
        measured.write(path)
