"""`python -m sim_bridge.study demo --seed 1 --duration 60`: a flight at message level, faster than real time."""

import argparse
import json
import math
import sys
from collections.abc import Callable
from importlib import import_module
from typing import Any

from groundstation.errors import SettingsError
from groundstation.field.resolved import ResolvedField
from groundstation.process import numba_cache
from sim_bridge.scenario import Scenario
from sim_bridge.settings_files import named_scenario, resolved_field
from sim_bridge.study.summary import summary
from sim_bridge.surroundings import LinkBursts
from sim_bridge.target_paths import FigureEight

_WRONG_SETTINGS = 2
# Studies that the ground station's experiments start, with an order on standard input.
_CAMPAIGNS = ("faults", "scenarios", "culprits", "calibrations", "missions")
_EXAMPLES = """examples:
  python -m sim_bridge.study demo --seed 3 --duration 60
  python -m sim_bridge.study demo --seeds 10 --set planner.hysteresis=0.1 --json
  python -m sim_bridge.study demo --field my_lab.yaml --outliers 0.02
  python -m sim_bridge.study vision --help"""


def _within(kind: type, least: float, most: float = math.inf) -> Callable[[str], Any]:
    """Return the reader of a number on the command line, finite and not outside of these limits."""

    def number(text: str) -> Any:
        value = kind(text)
        if not (least <= value <= most and math.isfinite(value)):
            limits = f"from {least:g} to {most:g}" if math.isfinite(most) else f"{least:g} or more"
            raise argparse.ArgumentTypeError(f"{text} must be {limits}")
        return value

    number.__name__ = "number" if kind is float else "whole number"  # argparse names it for what is none
    return number


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="python -m sim_bridge.study", epilog=_EXAMPLES, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("study", choices=["demo"], help="demo: all drones of the field track the target")
    parser.add_argument("--field", default="lab", help="field file, or a shipped one's name (default: %(default)s)")
    parser.add_argument("--scenario", help="scenario file, or a shipped one's name (default: the honest one)")
    parser.add_argument("--set", action="append", default=[], metavar="A.B=C", help="override one setting of the field")
    parser.add_argument("--seed", type=_within(int, 0), default=1)
    parser.add_argument(
        "--seeds", type=_within(int, 1, 1000), default=1, metavar="N", help="run N seeds from --seed on"
    )
    duration, share = _within(float, 1, 3600), _within(float, 0, 1)
    parser.add_argument("--duration", type=duration, default=60.0, help="seconds of tracking after take-off")
    parser.add_argument("--outliers", type=share, default=0.0, help="share of grossly wrong sightings")
    parser.add_argument("--start-phase", type=share, help="where on its figure of eight the target starts, in turns")
    parser.add_argument("--hover", action="store_true", help="no planner: drones hover where they took off")
    parser.add_argument("--json", action="store_true", help="one JSON object per run")
    return parser


def main() -> int:
    """Run the studies that the arguments ask for; exit code 0, or that of the settings error."""
    if sys.argv[1:2] == ["vision"]:
        from sim_bridge.study.vision.command import main as vision

        return vision(sys.argv[2:])
    if sys.argv[1:2] and sys.argv[1] in _CAMPAIGNS:
        from sim_bridge.study.faults.flight_order import fly_seeds

        return fly_seeds(import_module(f"sim_bridge.study.{sys.argv[1]}.command").fly)
    parser = _parser()
    arguments = parser.parse_args()
    try:
        field = resolved_field(arguments.field, arguments.set)
        scenario = named_scenario(arguments.scenario) if arguments.scenario else Scenario()
        if arguments.start_phase is not None:
            if not isinstance(scenario.target.path, FigureEight):
                parser.error(f"--start-phase: the target's path is {scenario.target.path.shape}, no figure of eight")
            scenario = _started(scenario, arguments.start_phase)
        if scenario.faults or scenario.link_bursts != LinkBursts():
            left_out = "faults and link bursts are left out here: groundstation experiment scenarios flies them"
            print(left_out, file=sys.stderr)
        _fly(field, scenario, arguments)
    except SettingsError as error:
        print(error, file=sys.stderr)
        return _WRONG_SETTINGS
    return 0


def _started(scenario: Scenario, phase: float) -> Scenario:
    """Return the scenario with the target elsewhere on its path [turns]."""
    path = scenario.target.path.model_copy(update={"start_phase": phase})
    return scenario.model_copy(update={"target": scenario.target.model_copy(update={"path": path})})


def _fly(field: ResolvedField, scenario: Scenario, arguments: argparse.Namespace) -> None:
    """Fly and print each seed; raises SettingsError for a planner of another package that fails."""
    numba_cache.activate()
    from sim_bridge.study.runner import Study, StudyOptions

    reports = []
    for seed in range(arguments.seed, arguments.seed + arguments.seeds):
        options = StudyOptions(seed, arguments.duration, arguments.outliers, not arguments.hover)
        report = Study(field, scenario, options).run()
        print(json.dumps(report) if arguments.json else _page(report), flush=True)
        reports.append(report)
    if len(reports) > 1 and not arguments.json:
        print(_page({f"mean of {len(reports)}, 95 %": "", **summary(reports, field)}))


def _page(report: dict[str, Any]) -> str:
    lines = []
    for name, value in report.items():
        shown = "  ".join(f"{k} {v}" for k, v in value.items()) if isinstance(value, dict) else value
        lines.append(f"{name:22s} {shown}")
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    raise SystemExit(main())
