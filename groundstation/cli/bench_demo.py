"""`groundstation bench demo`: the demo once per seed, one after the other, each judged by its own report."""

import json
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import click

from groundstation.cli.exits import ExitCode
from groundstation.cli.numbers import FiniteRange

# Start-up, take-off, landing and report around the tracking itself; then SIGTERM (which lands), then SIGKILL.
_OVERHEAD_S = 240.0
_LANDING_S = 60.0
_STOPPING_S = 10.0
_DEFAULT_DURATION_S = 60.0
_COLUMNS = (
    ("rmse m", "target_rmse_m", "{:.3f}"),
    ("lost s", "target_lost_s", "{:.1f}"),
    ("fence m", "max_fence_violation_m", "{:.2f}"),
    ("apart m", "min_separation_m", "{:.2f}"),
    ("flat s", "topology_seconds.flat", "{:.0f}"),
    ("string s", "topology_seconds.string", "{:.0f}"),
    ("switches", "topology_switches", "{:d}"),
    ("cores", "mean_cpu_cores", "{:.2f}"),
    ("plan p99 ms", "planner_p99_ms", "{:.0f}"),
    ("missed %", "tracker_missed_percent", "{:.2f}"),
    ("sim late %", "sim_overrun_percent", "{:.2f}"),
)


@dataclass(frozen=True, slots=True)
class DemoOutcome:
    """One demo: its exit code, its report (None if it left none that can be read), and its duration."""

    seed: int
    exit_code: int
    seconds: float
    folder: Path
    report: dict[str, Any] | None

    @property
    def passed(self) -> bool:
        """Return whether exit code and report both say that it passed."""
        return self.exit_code == 0 and self.report is not None and self.report.get("passed") is True

    @property
    def verdict(self) -> str:
        """Return "passed", or the reason of the failure in a few words."""
        if self.passed:
            return "passed"
        if self.report is None:
            return f"no report (exit code {self.exit_code})"
        if not self.report.get("valid", True):
            return "invalid: simulator late"
        failed = [criterion["name"] for criterion in self.report.get("criteria", []) if not criterion["ok"]]
        return ", ".join(failed) or f"exit code {self.exit_code}"


@click.command(
    epilog="\b\nExamples:\n  groundstation bench demo --seeds 10\n  groundstation bench demo --seeds 3 --json"
)
@click.option(
    "--seeds", type=click.IntRange(1, 1000), default=3, show_default=True, help="Number of flights, one for each seed."
)
@click.option("--first", type=int, default=1, show_default=True, help="The first seed.")
@click.option("--duration", type=FiniteRange(1, 3600), help="Seconds of tracking each (default: the demo's own).")
@click.option(
    "-o",
    "--output",
    "out",
    type=click.Path(file_okay=False, path_type=Path),
    help="Folder for all runs (default: in ./runs).",
)
@click.option("--json", "as_json", is_flag=True, help="Print the outcomes as JSON.")
def demo(seeds: int, first: int, duration: float | None, out: Path | None, as_json: bool) -> int:
    """Fly the demo once per seed and judge each flight. Exit code 0 only if all of them passed."""
    folder = out or Path("runs") / f"bench-{datetime.now(UTC):%Y%m%dT%H%M%SZ}"
    say = (lambda _text: None) if as_json else click.echo
    for number in (signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, _interrupt)
    outcomes = list(fly_all(range(first, first + seeds), duration, folder, say))
    if as_json:
        click.echo(json.dumps(as_builtins(outcomes), indent=2))
    else:
        from groundstation.cli.terminal import show

        show(table(outcomes))
    return ExitCode.OK if len(outcomes) == seeds and all(outcome.passed for outcome in outcomes) else ExitCode.FAILED


def fly_all(
    seeds: range, duration_s: float | None, folder: Path, say: Callable[[str], object]
) -> Iterator[DemoOutcome]:
    """Yield the outcome of each seed; after Ctrl-C the present flight lands and no other follows."""
    for number, seed in enumerate(seeds, start=1):
        outcome, interrupted = fly_one(seed, duration_s, folder / f"seed-{seed}")
        say(f"{number}/{len(seeds)}  seed {seed}: {outcome.verdict}  ({outcome.seconds:.0f} s)")
        yield outcome
        if interrupted:
            say("interrupted")
            return


def demo_command(seed: int, duration_s: float | None, folder: Path) -> list[str]:
    """Return the command line of one demo."""
    command = [sys.executable, "-m", "groundstation", "demo", "--headless", "--seed", str(seed)]
    if duration_s is not None:
        command += ["--duration", f"{duration_s:g}"]
    return [*command, "--output", str(folder)]


def fly_one(seed: int, duration_s: float | None, folder: Path) -> tuple[DemoOutcome, bool]:
    """Run one demo to its end; returns its outcome, and whether the operator interrupted."""
    folder.mkdir(parents=True, exist_ok=True)
    for stale in folder.rglob("report.json"):
        stale.unlink()
    began = time.monotonic()
    with (folder / "output.log").open("wb") as log:
        process = subprocess.Popen(
            demo_command(seed, duration_s, folder),
            stdin=subprocess.DEVNULL,
            stdout=log,
            stderr=subprocess.STDOUT,
            start_new_session=True,  # Ctrl-C comes through us, once: a second one would not wait for the landing
        )
        interrupted = _wait(process, (duration_s or _DEFAULT_DURATION_S) + _OVERHEAD_S)
    seconds = time.monotonic() - began
    return DemoOutcome(seed, process.returncode, seconds, folder, _report_in(folder)), interrupted


def _wait(process: subprocess.Popen[bytes], limit_s: float) -> bool:
    """Wait for the end; after limit_s or Ctrl-C let it land, at the second stop it; return whether Ctrl-C came."""
    interrupted = False
    for patience_s in (limit_s, _LANDING_S, _STOPPING_S):
        try:
            process.wait(patience_s)
            return interrupted
        except subprocess.TimeoutExpired:
            pass
        except KeyboardInterrupt:
            interrupted = True
        process.send_signal(signal.SIGTERM)
    process.kill()
    process.wait()
    return interrupted


def _interrupt(_number: int, _frame: object) -> None:
    raise KeyboardInterrupt


def _report_in(folder: Path) -> dict[str, Any] | None:
    for path in folder.rglob("report.json"):
        try:
            content = json.loads(path.read_bytes())
        except (OSError, ValueError):
            continue
        if isinstance(content, dict):
            return content
    return None


def _value(report: dict[str, Any] | None, path: str) -> Any:
    value: Any = report
    for name in path.split("."):
        value = value.get(name) if isinstance(value, dict) else None
    return value


def as_builtins(outcomes: list[DemoOutcome]) -> dict[str, Any]:
    """Return the outcomes as --json prints them."""
    runs = [
        {
            "seed": outcome.seed,
            "passed": outcome.passed,
            "verdict": outcome.verdict,
            "exit_code": outcome.exit_code,
            "seconds": round(outcome.seconds, 1),
            "folder": str(outcome.folder),
            **{path: _value(outcome.report, path) for _, path, _ in _COLUMNS},
        }
        for outcome in outcomes
    ]
    return {"runs": runs, "passed": sum(outcome.passed for outcome in outcomes), "flown": len(outcomes)}


def table(outcomes: list[DemoOutcome]) -> Any:
    """Return the outcomes as a rich table."""
    from rich.table import Table
    from rich.text import Text

    grid = Table(box=None, header_style="dim")
    for title in ("seed", *(title for title, _, _ in _COLUMNS)):
        grid.add_column(title, justify="right")
    grid.add_column("verdict")
    for outcome in outcomes:
        values = ((_value(outcome.report, path), form) for _, path, form in _COLUMNS)
        cells = ["-" if value is None else form.format(value) for value, form in values]
        grid.add_row(str(outcome.seed), *cells, Text(outcome.verdict, style="green" if outcome.passed else "bold red"))
    passed = sum(outcome.passed for outcome in outcomes)
    grid.caption = f"{passed} of {len(outcomes)} passed"
    return grid
