"""`groundstation preflight`: starts everything, checks it and stops it again; no drone takes off."""

import click

from groundstation.cli.run import SETTINGS, Rehearsal, run_real, run_simulated


@click.command(
    epilog="\b\nExamples:\n  groundstation preflight lab.yaml\n  groundstation preflight lab --scenario realistic\n\n"
    "Exit codes: 0 nothing must be mended, 1 something must or nobody would take off, 2 wrong settings, "
    "4 a process failed, 130 it was broken off."
)
@click.argument("field")
@click.option("--scenario", metavar="S", help="Check emulated devices under a scenario instead of the real ones.")
@click.option("--seed", type=click.IntRange(0), help="Seed of all noise of emulated devices.")
@SETTINGS
def preflight(field: str, scenario: str | None, seed: int | None, options: tuple[str, ...]) -> int:
    """Check what forbids a take-off: links, batteries, cameras, and which drone stands on which pad.

    Starts the field's drivers and cameras, and stops them again. MUST forbids a take-off, SHOULD makes flights worse.
    """
    if scenario is None:
        return run_real("preflight", field, options, headless=True, look_only=True)
    asked = Rehearsal(scenario, None, seed, None, headless=True, anyway=False, options=options, look_only=True)
    return run_simulated("preflight", field, asked)
