"""`sitl` and `fly`: the same processes and the same flight, against emulated or real devices."""

import os
import shutil
import sys
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from groundstation.cli.exits import ExitCode
from groundstation.cli.numbers import FiniteRange
from groundstation.cli.terminal import can_be_drawn_on

if TYPE_CHECKING:
    from groundstation.flight.composition import Simulation
    from groundstation.flight.flight_plan import FlightPlan
    from groundstation.flight.loop import FlightOutcome
    from groundstation.report.judge import RunReport
    from groundstation.report.run_facts import RunFacts
    from groundstation.settings.schema import Field

Option = Callable[[Callable[..., Any]], Callable[..., Any]]


_ANYWAY = click.option("--anyway", is_flag=True, help="Take off even if a check forbids it; this is recorded.")
SETTINGS = click.option("--set", "options", multiple=True, metavar="A.B=C", help="Override one setting; repeatable.")
_HEADLESS = click.option("--headless", is_flag=True, help="Plain lines instead of the live table.")
_SIMULATED: tuple[Option, ...] = (
    click.option(
        "--scenario", default="realistic", show_default=True, help="A scenario file, or the name of a shipped one."
    ),
    click.option(
        "--duration",
        type=FiniteRange(1, 86_400),
        help="Seconds of tracking before the landing (default: until Ctrl-C; demo: 60).",
    ),
    click.option("--seed", type=click.IntRange(0), help="Seed of all noise (default: the scenario's)."),
    click.option(
        "-o",
        "--output",
        type=click.Path(file_okay=False, path_type=Path),
        help="Where to put the run folder and a copy of the report (default: runs/, without a copy).",
    ),
    _HEADLESS,
    _ANYWAY,
    click.option(
        "--network",
        metavar="A.B.C.0/24",
        default="",
        help="Network in which other hosts reach their emulated devices: drones at .11 and up, cameras at .50 and up.",
    ),
    SETTINGS,
)


def simulated_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """Add the options that `sitl` and `demo` share."""
    for option in reversed(_SIMULATED):
        command = option(command)
    return command


@click.command(
    epilog="\b\nExamples:\n  groundstation sitl config/lab.yaml --duration 60\n"
    "  groundstation sitl lab --seed 3 --headless --set planner.mode=paper\n"
    "  groundstation sitl mixed-team --real drone_2=autopilot:19410   (firmware in the loop)\n\n"
    "Exit codes: 0 passed, 1 failed its criteria, 2 wrong settings, 4 a process failed, 130 interrupted."
)
@click.argument("field")
@simulated_options
@click.option(
    "--real",
    multiple=True,
    metavar="PART[=POSE]",
    help="A real device: a drone, camera, target, motion capture or ranging system of the field; repeatable. POSE is "
    "where a drone's true pose comes from: autopilot:PORT (its firmware's simulator), the name of a motion capture "
    "system, or estimate (default).",
)
def sitl(field: str, **arguments: Any) -> int:
    """Fly a field file against emulated drones and cameras. Ctrl-C lands; a second one stops at once.

    With a real drone no drone takes off before Enter, or `groundstation takeoff`.
    """
    return run_simulated("sitl", field, Rehearsal(**arguments))


@click.command(
    epilog="\b\nExamples:\n  groundstation fly lab.yaml\n  groundstation takeoff   (from another terminal)\n"
    "  groundstation land      (from another terminal)\n\n"
    "Exit codes: 0 all landed, 1 a landing was not reported, 2 wrong settings, 4 a process failed, "
    "130 stopped before every drone was heard."
)
@click.argument("field")
@_HEADLESS
@_ANYWAY
@SETTINGS
def fly(field: str, headless: bool, anyway: bool, options: tuple[str, ...]) -> int:
    """Fly a field file with the real drones. No drone takes off before Enter, or `groundstation takeoff`.

    Ctrl-C lands; a second one stops at once.
    """
    return run_real("fly", field, options, headless=headless, anyway=anyway)


def run_real(
    mode: str, field: str, options: tuple[str, ...], *, headless: bool, anyway: bool = False, look_only: bool = False
) -> int:
    """Fly a field with the real drones, or only look at them, and return the exit code."""
    from groundstation.flight.composition import fly_endpoint
    from groundstation.flight.flight_plan import plan_of
    from groundstation.report.run_facts import RunFacts
    from groundstation.settings.cautions import ALL
    from groundstation.settings.files import find_field
    from groundstation.settings.load import load_field
    from groundstation.supervisor.network import require_free

    path = find_field(field)
    loaded = load_field(path, options)
    plan = plan_of(loaded, None, asks=not look_only, checks=ALL)
    plan = replace(plan, anyway=anyway, look_only=look_only)
    require_free(fly_endpoint(loaded))
    return _run(path, loaded, plan, RunFacts(mode=mode, field=str(path)), headless=headless)


@dataclass(frozen=True, slots=True)
class Rehearsal:
    """The options of `sitl` and `demo`; real: parts that are not emulated; look_only: no drone takes off.

    network: address at which other hosts reach emulated devices.
    """

    scenario: str
    duration: float | None
    seed: int | None
    output: Path | None
    headless: bool
    anyway: bool
    options: tuple[str, ...]
    real: tuple[str, ...] = ()
    look_only: bool = False
    network: str = ""


def run_simulated(mode: str, field: str, asked: Rehearsal) -> int:
    """Fly a field in the simulator, judge the run, and return the exit code."""
    from groundstation.flight.composition import Simulation, simulated
    from groundstation.flight.flight_plan import plan_of
    from groundstation.flight.real_parts import notes, parse_real
    from groundstation.report.run_facts import RunFacts
    from groundstation.settings.files import find_field, find_scenario
    from groundstation.settings.load import load_field
    from groundstation.settings.scenario import Room, load_scenario
    from groundstation.settings.scenario_fit import made_for, misfits
    from groundstation.supervisor import network, runtime_file

    path, scenario, duration, seed = find_field(field), asked.scenario, asked.duration, asked.seed
    loaded = load_field(path, asked.options)
    parts = parse_real(loaded, asked.real)
    for name, body in parts.drones.items():
        if body.address is not None:
            network.require_free_udp(f"the true pose of {name} (--real)", *body.address)
    for line in notes(loaded, parts):
        click.echo(line, err=True)
    plan = plan_of(loaded, duration, asks=bool(parts.drones) and not asked.look_only)
    plan = replace(plan, anyway=asked.anyway, look_only=asked.look_only)
    chosen = load_scenario(find_scenario(scenario, path), room=Room(loaded, parts.bodies, parts.cameras))
    if seed is None:
        seed = int(chosen.get("seed", 1))
    for sentence in misfits(loaded, chosen) + made_for(path, chosen):
        click.echo(f"scenario {scenario}: {sentence}", err=True)
    net = network.claim(runtime_file.folder(), loaded.bus.port, asked.network)
    try:
        simulation = Simulation(net, chosen, seed, parts)
        facts = RunFacts(
            mode=mode, field=str(path), scenario=scenario, seed=seed, tracking_s=duration, real=parts.names,
            expected=chosen.get("expected"),
        )  # fmt: skip
        there = simulated(loaded, net, parts)
        output = asked.output
        return _run(path, there, plan, facts, headless=asked.headless, simulation=simulation, output=output)
    finally:
        net.release()


def _run(
    path: Path,
    field: "Field",
    plan: "FlightPlan",
    facts: "RunFacts",
    *,
    headless: bool,
    simulation: "Simulation | None" = None,
    output: Path | None = None,
) -> int:
    from groundstation.flight.composition import fly_endpoint, process_table
    from groundstation.flight.loop import Flight, require_outcome
    from groundstation.flight.retention import make_room
    from groundstation.flight.run_folder import log_to, make_run_dir, write_facts
    from groundstation.settings.resolved import yaml_of
    from groundstation.supervisor.run import Run
    from groundstation.supervisor.supervisor import Supervisor
    from groundstation.supervisor.terminal import Terminal

    removed = [] if output else make_room(Path(field.recording.directory), field.recording.keep_gb)
    run_dir = make_run_dir(output or Path(field.recording.directory), path.stem)
    (run_dir / "resolved.yaml").write_text(yaml_of(field))
    write_facts(run_dir, facts, asks=plan.asks)
    log_to(run_dir)
    endpoint = simulation.network.endpoint if simulation else fly_endpoint(field)
    monitor = not headless and can_be_drawn_on()
    table = process_table(field, endpoint, run_dir, simulation=simulation, monitor=monitor)
    terminal = Terminal()
    terminal.say(f"{facts.mode} {path}: {len(table)} processes, run folder {run_dir}")
    if removed:
        size = sum(run.size for run in removed) / 1e9
        names = f"{removed[0].folder.name} ... {removed[-1].folder.name}" if removed[1:] else removed[0].folder.name
        terminal.say(f"recording.keep_gb {field.recording.keep_gb:g}: removed {names} ({size:.1f} GB)")
    real = tuple(simulation.real.drones) if simulation else tuple(field.drones)
    run = Run(field.site, str(path), endpoint, run_dir, tuple(field.drones), real, field.bus.listen)
    supervisor = Supervisor(run, table, terminal)
    try:
        outcome = Flight(supervisor, plan, terminal).run()
        terminal.flush()
        judged = field.recording.enabled and not plan.look_only
        passed = _judge(run_dir, output) if judged else None
    finally:
        supervisor.close()  # by then the page has shown the result of the run
    require_outcome(outcome)
    return _exit_code(outcome, plan, passed, judged_by_landing=facts.mode == "fly")


def _exit_code(
    outcome: "FlightOutcome", plan: "FlightPlan", passed: bool | None, *, judged_by_landing: bool
) -> ExitCode:
    if plan.look_only:
        unsaid = ExitCode.INTERRUPTED if outcome.interrupted else ExitCode.OK
        return ExitCode.FAILED if outcome.forbidden else unsaid
    judged_early = passed is not None and plan.duration_s is not None
    if outcome.interrupted and (outcome.landed is None or judged_early):
        return ExitCode.INTERRUPTED
    if passed is None or judged_by_landing or plan.duration_s is None:
        passed = outcome.landed
    return ExitCode.OK if passed else ExitCode.FAILED


def _build(run_dir: Path) -> "RunReport":
    from groundstation.report.build import build_report
    from groundstation.report.gather import gather
    from groundstation.report.judge import judge

    try:
        return build_report(run_dir)
    except OSError as error:  # the disk is full: the recording can still be judged and shown
        click.echo(f"the report cannot be written to {run_dir}: {error.strerror}", err=True)
        return judge(gather(run_dir), run_dir)


def _judge(run_dir: Path, copy_to: Path | None) -> bool | None:
    """Write and print the report; None if there is nothing to judge. It is written even if the terminal is closed."""
    from groundstation.errors import GroundStationError
    from groundstation.report.file_names import HTML_NAME, JSON_NAME, PLOT_NAME

    try:
        built = _build(run_dir)
    except GroundStationError as error:
        click.echo(f"no report: {error}", err=True)
        return False
    for name in (HTML_NAME, JSON_NAME, PLOT_NAME) if copy_to is not None else ():
        with suppress(OSError):
            shutil.copy(run_dir / name, copy_to or run_dir)
    try:
        from groundstation.cli.terminal import show
        from groundstation.report.summary import summary

        show(summary(built))
    except OSError:
        # The terminal was closed; the interpreter would fail once more when it flushes at exit.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    return bool(built.passed)
