"""A complete re-run: the run, and its verdict in words and in JSON."""

import hashlib
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import nullcontext
from pathlib import Path
from typing import Any

import msgspec

from groundstation.appearance.topology import topology_words
from groundstation.field.resolved import ResolvedField
from groundstation.recording.outputs import removed_if_unfinished
from groundstation.recording.reader import RecordingError
from groundstation.replay import counterfactual, versions
from groundstation.replay.rerun_export import live_again, require_new
from groundstation.replay.source import Source
from groundstation.replay.verify import Comparison, Repetition
from groundstation.report.gather import gather

_SHOWN = 5


class Again:
    """Re-runs a source; with changes twice, without and with them, so that the runs differ by nothing else.

    field: the resolved field as recorded; changed: the one to run with; changes: in words, none: only verify.
    """

    def __init__(
        self,
        source: Source,
        field: ResolvedField,
        changed: ResolvedField,
        changes: Sequence[str],
        output: Path | None,
    ) -> None:
        self._source = source
        self._field, self._changed = field, changed
        self._changes = tuple(changes)
        self._output = output
        self._digest, self._plain_digest = hashlib.sha256(), hashlib.sha256()
        self._rows: list[counterfactual.Row] = []
        self._parted = counterfactual.Changes()
        self._others: Comparison | None = None
        if output is not None:
            require_new(output)

    def run(self) -> Comparison:
        """Run all ticks as recorded, then with the changes; returns the comparison of the first run.

        Raises RecordingError if the recording cannot be re-run. An unfinished output is removed: it would look like a
        whole flight.
        """
        with removed_if_unfinished(self._output) if self._output else nullcontext():
            return self._run()

    def _run(self) -> Comparison:
        plain = Repetition(self._source, self._field, self._plain_digest.update)
        if not self._changes:
            self._live(plain, self._output)
            self._digest = self._plain_digest
            return plain.comparison
        with tempfile.TemporaryDirectory(prefix="skein-replay-") as scratch:
            before, after = Path(scratch) / "before", self._output or Path(scratch) / "after"
            self._live(plain, before)
            changed = Repetition(self._source, self._changed, self._digest.update)
            live_again(self._source, changed, after, msgspec.json.encode(self._changed), ", ".join(self._changes))
            self._others = changed.comparison
            first, second = gather(before), gather(after)
        self._rows = counterfactual.rows_of(first, second)
        self._parted = counterfactual.changes_of(first, second)
        return plain.comparison

    def _live(self, plain: Repetition, folder: Path | None) -> None:
        if folder is None:
            for _ in plain.ticks():
                pass
        else:
            live_again(self._source, plain, folder, msgspec.json.encode(self._field), "")
        name = self._source.name
        if not plain.comparison.ticks:
            raise RecordingError(f"{name}: no journal of the tracker is in it, so nothing says what it did when")
        if not plain.tape.inputs:
            raise RecordingError(f"{name}: no odometry, observation or vehicle status is in it: nothing to re-run with")

    @property
    def digest(self) -> str:
        """Return a hash of all present messages: equal for identical re-runs."""
        return self._digest.hexdigest()[:16]

    def lines(self, result: Comparison) -> Iterator[str]:
        """Yield the verdict for people."""
        yield (
            f"{self._source.name}: {result.ticks} ticks, {result.plans} plans, {result.recorded_s:.1f} s recorded, "
            f"re-run in {result.cpu_s:.1f} s of CPU ({result.speed:.0f} x)"
        )
        yield from self._reservations(result)
        if self._others is not None:
            if not result.identical:
                yield "today's tracker is not the recorded one even with its settings; compared are two re-runs of it"
            yield f"with {', '.join(self._changes)} (output {self.digest}):"
            yield from self._counterfactual(result, self._others)
        else:
            yield from self._verdict(result)
        if self._output is not None:
            yield f"written to {self._output}"

    def _reservations(self, result: Comparison) -> Iterator[str]:
        yield from (f"other than recorded: {line}" for line in versions.foreign(self._source.versions))
        yield from (f"not all of it: {line}" for line in result.fragments)
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

    def _counterfactual(self, plain: Comparison, changed: Comparison) -> Iterator[str]:
        if self._digest.digest() == self._plain_digest.digest():
            yield "  nothing changed: the tracker says the same, to the bit"
            return
        width = max(len(row.name) for row in self._rows)
        yield f"  {'':{width}}  {'before':>10}  {'with it':>10}"
        for row in self._rows:
            yield f"  {row.name:{width}}  {_number(row.before):>10}  {_number(row.after):>10}{_arrow(row)}"
        if plain.identical and changed.findings:
            yield f"first difference: {changed.findings[0]}"
        for name, where in self._parted.farthest.items():
            yield f"{name}: estimates at most {where['m']:.3f} m apart, at {where['at_s']:.1f} s"
        yield f"another topology chosen for {self._parted.topology_other_s:.1f} s"
        for begin, end, before, after in self._parted.topologies[:_SHOWN]:
            was, now = topology_words(before), topology_words(after)
            yield f"  {begin:.1f} to {end:.1f} s: {was} before, {now} with it"

    def as_json(self, result: Comparison) -> bytes:
        """Return all of it for programs."""
        content: dict[str, Any] = {
            "recording": self._source.name,
            "with": self._changes,
            "identical": result.identical,
            "output_sha256": self._digest.hexdigest(),
            "foreign": versions.foreign(self._source.versions),
            "comparison": {name: getattr(result, name) for name in _COUNTS},
            "first_differences": [str(finding) for finding in result.findings],
        }
        if self._others is not None:
            content["changed_anything"] = self._digest.digest() != self._plain_digest.digest()
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
    if row.before == row.after:
        return ""
    return f"  {row.after - row.before:+.4g}" if row.before is not None and row.after is not None else "  *"
