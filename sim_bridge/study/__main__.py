"""`python -m sim_bridge.study demo --seed 1 --duration 60`: a flight at message level, faster than real time."""

import argparse
import json
import sys
from importlib import import_module
from typing import Any

from groundstation.errors import SettingsError
from groundstation.process import numba_cache
from sim_bridge.scenario import Scenario
from sim_bridge.settings_files import named_scenario, resolved_field
from sim_bridge.study.summary import summary
from sim_bridge.surroundings import LinkBursts

_WRONG_SETTINGS = 2
# Studies that the ground station's experiments start, with an order on standard input.
_CAMPAIGNS = ("faults", "scenarios", "culprits", "calibrations", "missions")
_EXAMPLES = """examples:
  python -m sim_bridge.study demo --seed 3 --duration 60
  python -m sim_bridge.study demo --seeds 10 --set planner.hysteresis=0.1 --json
  python -m sim_bridge.study demo --field my_lab.yaml --outliers 0.02
  python -m sim_bridge.study vision --help"""


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="python -m sim_bridge.study", epilog=_EXAMPLES, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("study", choices=["demo"], help="demo: all drones of the field track the target")
    parser.add_argument("--field", default="lab", help="field file, or a shipped one's name (default: %(default)s)")
    parser.add_argument("--scenario", help="scenario file, or a shipped one's name (default: the honest one)")
    parser.add_argument("--set", action="append", default=[], metavar="A.B=C", help="override one setting of the field")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--seeds", type=int, default=1, metavar="N", help="run N seeds from --seed on")
    parser.add_argument("--duration", type=float, default=60.0, help="seconds of tracking after take-off")
    parser.add_argument("--outliers", type=float, default=0.0, help="share of grossly wrong sightings")
    parser.add_argument("--start-phase", type=float, help="where on its path the target starts, in turns")
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
    arguments = _parser().parse_args()
    try:
        field = resolved_field(arguments.field, arguments.set)
        scenario = named_scenario(arguments.scenario) if arguments.scenario else Scenario()
    except SettingsError as error:
        print(error, file=sys.stderr)
        return _WRONG_SETTINGS
    if arguments.start_phase is not None:
        path = scenario.target.path.model_copy(update={"start_phase": arguments.start_phase})
        scenario = scenario.model_copy(update={"target": scenario.target.model_copy(update={"path": path})})
    if scenario.faults or scenario.link_bursts != LinkBursts():
        print(
            "faults and link bursts are left out here: groundstation experiment scenarios flies them", file=sys.stderr
        )
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
    return 0


def _page(report: dict[str, Any]) -> str:
    lines = []
    for name, value in report.items():
        shown = "  ".join(f"{k} {v}" for k, v in value.items()) if isinstance(value, dict) else value
        lines.append(f"{name:22s} {shown}")
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    raise SystemExit(main())
