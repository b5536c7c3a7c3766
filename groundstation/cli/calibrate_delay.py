"""`groundstation calibrate delay`: measures the delay of each sensor from a recorded flight."""

import json
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING

import click

from groundstation.cli.exits import ExitCode

if TYPE_CHECKING:
    from groundstation.calibration.sensor_delay import Delay


@click.command(
    epilog="\b\nExamples:\n  groundstation calibrate delay runs/20261120T101500Z-lab\n"
    "  groundstation calibrate delay RUN --json\n\n"
    "The flight should turn the drones in sight of the fixed camera and move them briskly, for three minutes; "
    "heights need five take-offs and landings. A delay that the recording does not show to 15 ms is not proposed; the "
    "flight that would show it is named.\n\n"
    "Exit codes: 0 done, 2 wrong usage, or no recording that can be used."
)
@click.argument("recording", nargs=-1, required=True, type=click.Path(exists=True, path_type=Path))
@click.option("--json", "as_json", is_flag=True, help="Print JSON.")
def delay(recording: tuple[Path, ...], as_json: bool) -> int:
    """Measure the delays of cameras, velocities and heights in RECORDING, and print the settings to change.

    Sensors are compared with each other: delays are measured against gyroscopes, whose delay is taken as zero.
    The same recording gives the same figures.
    """
    from groundstation.cli.recorded_flight import recorded_flight
    from groundstation.settings.resolved import resolved_field

    name, flown_with, flown = recorded_flight(recording)
    from groundstation.calibration.delay import delays

    found = delays(flown, resolved_field(flown_with))
    if as_json:
        click.echo(json.dumps([asdict(one) | {"sure": one.sure} for one in found], indent=2))
    else:
        click.echo(f"{name}: {flown.duration_s:.0f} s, {sum(flown.cameras.values())} observations")
        click.echo("\n".join(_lines(found)))
    return ExitCode.OK


def _lines(found: "list[Delay]") -> list[str]:
    lines = [f"{'sensor':22} {'setting':>9} {'measured':>18}"]
    for one in found:
        measured = f"{one.measured_ms:.0f} +- {one.std_ms:.0f} ms" if one.measured_ms is not None else "-"
        remark = one.reason or ("" if one.sure else "too unsure to use")
        lines.append(f"{one.sensor:22} {one.now_ms:6.0f} ms {measured:>18}  {remark}".rstrip())
    changed = [one for one in found if one.differs]
    lines.append("settings to change:" if changed else "no setting is contradicted")
    lines += [f"  {one.setting}: {one.measured_ms:.0f}" for one in changed]
    flights: dict[str, list[str]] = {}
    for one in found:
        if not one.sure or one.reason:
            flights.setdefault(one.flight, []).append(one.sensor)
    if flights:
        lines.append("not shown by this recording; a flight that would show it:")
    return lines + [f"  {', '.join(sensors)}: {flight}" for flight, sensors in flights.items()]
