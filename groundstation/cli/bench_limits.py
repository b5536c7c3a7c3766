"""Compares figures of a bench with their limits, and prints them and the machine's load for people or programs."""

import json
import os
from collections.abc import Mapping
from typing import Any

import click

from groundstation.cli.exits import ExitCode


def judge(figures: Mapping[str, Any], limits: Mapping[str, float], measure: str, as_json: bool) -> ExitCode:
    """Print the figures and which limits they miss; a figure that is a mapping is judged by its entry `measure`.

    A limit without its figure is named and not judged: this machine lacks something that the figure needs.
    """

    def value(name: str) -> float:
        figure = figures[name]
        return float(figure[measure] if isinstance(figure, dict) else figure)

    missed = [name for name, limit in limits.items() if name in figures and not value(name) <= limit]
    unknown = [name for name in limits if name not in figures]
    everything = {**figures, "load_average": round(os.getloadavg()[0], 1), "limits": dict(limits)}
    if as_json:
        click.echo(json.dumps(everything | {"not_measured": unknown, "passed": not missed}, indent=2))
    else:
        for name, figure in everything.items():
            click.echo(f"{name.replace('_', ' '):24} {figure}")
        verdict = f"missed: {', '.join(missed)}" if missed else "all limits are kept"
        click.echo(verdict + (f"; not measured: {', '.join(unknown)}" if unknown else ""))
    return ExitCode.FAILED if missed else ExitCode.OK
