"""A re-run from beginning to end: the run, its verdict in words and in JSON."""

import hashlib
import tempfile
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import msgspec

from groundstation.recording.part_names import part_path
from groundstation.recording.reader import RecordingError
from groundstation.recording.selection import STATE
from groundstation.replay import counterfactual, versions
from groundstation.replay.rewrite import live_again, require_new
from groundstation.replay.source import Source
from groundstation.replay.verify import Comparison, Repetition
from groundstation.report.gather import gather

_SHOWN = 5


class Again:
    """Re-runs a source with a resolved field; `changes`: what is not as it was recorded, in words (none: verify)."""

    def __init__(self, source: Source, field: dict[str, Any], changes: Sequence[str], output: Path | None) -> None:
        self._source = source
        self._field = field
        self._changes = tuple(changes)
        self._output = output
        self._digest = hashlib.sha256()
        self._rows: list[counterfactual.Row] = []
        self._parted = counterfactual.Changes()
        if output is not None:
            require_new(output)

    def run(self) -> Comparison:
        """Live all ticks again; raises RecordingError when the recording holds nothing to do it with."""
        repetition = Repetition(self._source, self._field, self._digest.update)
        if self._output is None and not self._changes:
            for _ in repetition.ticks():
                pass
        else:
            with tempfile.TemporaryDirectory(prefix="skein-replay-") as scratch:
                self._write(repetition, Path(scratch))
        self._require_something(repetition)
        return repetition.comparison

    def _write(self, repetition: Repetition, scratch: Path) -> None:
        target = self._output or scratch / "now"
        field = msgspec.json.encode(self._field)
        live_again(self._source, repetition, target, field, ", ".join(self._changes))
        recorded = scratch / "recorded"
        recorded.mkdir()
        for number, path in enumerate(self._source.state, 1):
            part_path(recorded, STATE, number).symlink_to(path.absolute())
        before, after = gather(recorded), gather(target)
        self._rows = counterfactual.rows_of(before, after)
        self._parted = counterfactual.changes_of(before, after)

    def _require_something(self, repetition: Repetition) -> None:
        name = self._source.name
        if not repetition.comparison.ticks:
            raise RecordingError(f"{name}: no journal of the tracker is in it, so nothing says what it did when")
        if not repetition.tape.inputs:
            raise RecordingError(f"{name}: no odometry, observation or vehicle status is in it: nothing to re-run with")

    @property
    def digest(self) -> str:
        """Return a hash of all that was said now: equal for equal re-runs, to the bit."""
        return self._digest.hexdigest()[:16]

    def lines(self, result: Comparison) -> Iterator[str]:
        """Yield the verdict for people."""
        yield (
            f"{self._source.name}: {result.ticks} ticks, {result.plans} plans, {result.recorded_s:.1f} s recorded, "
            f"re-run in {result.cpu_s:.1f} s of CPU ({result.speed:.0f} x)"
        )
        yield from self._reservations(result)
        if self._changes:
            yield f"with {', '.join(self._changes)} (output {self.digest}):"
            yield from self._counterfactual(result)
        else:
            yield from self._verdict(result)
        if self._output is not None:
            yield f"written to {self._output}"

    def _reservations(self, result: Comparison) -> Iterator[str]:
        yield from (f"other than recorded: {line}" for line in versions.foreign(self._source.versions))
        yield from (f"not from its beginning: {line}" for line in result.fragments)
        if result.missing_count:
            yield f"{result.missing_count} messages that the tracker took in are not recorded: {result.missing[0]}"
        lost = sum(result.unrecorded.values())
        if lost:
            yield f"{lost} messages of the tracker are not recorded and cannot be compared"
        yield from result.damage[:_SHOWN]

    def _verdict(self, result: Comparison) -> Iterator[str]:
        compared = ", ".join(f"{count} {name}s" for name, count in result.same.most_common())
        if result.identical:
            yield f"IDENTICAL to the bit: {compared} (output {self.digest})"
            return
        if not result.differing:
            yield f"NOT PROVEN IDENTICAL: what could be compared is the same ({compared or 'nothing'})"
            return
        total = result.differing + sum(result.same.values())
        yield f"DIFFERS in {result.differing} of {total} messages; the first:"
        yield from (f"  {finding}" for finding in result.findings[:_SHOWN])

    def _counterfactual(self, result: Comparison) -> Iterator[str]:
        if not result.differing:
            yield "  nothing changed: the tracker says the same, to the bit"
            return
        width = max(len(row.name) for row in self._rows)
        yield f"  {'':{width}}  {'recorded':>10}  {'now':>10}"
        for row in self._rows:
            yield f"  {row.name:{width}}  {_number(row.recorded):>10}  {_number(row.now):>10}{_arrow(row)}"
        yield f"first difference: {result.findings[0]}"
        for name, where in self._parted.farthest.items():
            yield f"{name}: estimates at most {where['m']:.3f} m apart, at {where['at_s']:.1f} s"
        yield f"another topology chosen for {self._parted.topology_other_s:.1f} s"
        for begin, end, recorded, now in self._parted.topologies[:_SHOWN]:
            yield f"  {begin:.1f} to {end:.1f} s: {recorded} recorded, {now} now"

    def as_json(self, result: Comparison) -> bytes:
        """Return all of it for programs."""
        content: dict[str, Any] = {
            "recording": self._source.name,
            "changes": self._changes,
            "identical": result.identical,
            "output_sha256": self._digest.hexdigest(),
            "foreign": versions.foreign(self._source.versions),
            "comparison": {name: getattr(result, name) for name in _COUNTS},
            "first_differences": [str(finding) for finding in result.findings],
        }
        if self._rows:
            content |= counterfactual.as_json(self._rows, self._parted)
        return msgspec.json.format(msgspec.json.encode(content), indent=2)


_COUNTS = (
    "ticks", "lives", "plans", "recorded_s", "cpu_s", "same", "unrecorded", "fragments", "missing_count", "missing",
    "differing", "damage",
)  # fmt: skip


def _number(value: float | None) -> str:
    if value is None:
        return "-"
    return f"{value:.0f}" if float(value).is_integer() else f"{value:.4f}"


def _arrow(row: counterfactual.Row) -> str:
    if not row.changed:
        return ""
    return f"  {row.now - row.recorded:+.4g}" if row.now is not None and row.recorded is not None else "  *"
