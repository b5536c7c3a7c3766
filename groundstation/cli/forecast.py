"""`groundstation forecast`: predicted accuracy over a field, blind places, and the cost of failures; no flight."""

import json
import math
import sys
import time
from pathlib import Path
from typing import TYPE_CHECKING

import click

from groundstation.cli.terminal import progress, show
from groundstation.errors import SettingsError
from groundstation.process.standard_streams import with_sequences

if TYPE_CHECKING:
    from groundstation.forecast.forecast import Forecast
    from groundstation.settings.drawing import Paths
    from groundstation.settings.schema import Field

_PICTURES, _LONG_S, _WIDTH = (".svg", ".png", ".pdf"), 15.0, 80
_SHOWN = "a path looks like '-2,0 2,0 2,1': places x,y [m; world]"


@click.command(
    epilog="\b\nExamples:\n  groundstation forecast lab\n"
    "  groundstation forecast lab.yaml --scenario realistic -o forecast.html\n"
    "  groundstation forecast lab.yaml --path '-2,0 2,0 2,1' --json | jq .path.worst_m"
)
@click.argument("field")
@click.option("--set", "options", multiple=True, metavar="A.B=C", help="Override one setting; repeatable.")
@click.option("--target", metavar="NAME", help="The target, if the field has several (default: the first).")
@click.option("--path", "drawn", metavar="'X,Y X,Y ..'", help="The target's path: corners [m; world].")
@click.option("--scenario", metavar="S", help="Take the target's path from a scenario (a name or a path).")
@click.option(
    "-o", "--output", type=click.Path(path_type=Path, dir_okay=False), help="Write the map as SVG, PNG, PDF or HTML."
)
@click.option("--json", "as_json", is_flag=True, help="Print all figures as JSON.")
def forecast(
    field: str, options: tuple[str, ...], target: str | None, drawn: str | None, scenario: str | None,
    output: Path | None, as_json: bool,
) -> None:  # fmt: skip
    """Predict how well the target will be known in a flight: over the floor, on its path, and when a device fails.

    Figures are standard deviations of the target's position, by the filter that flies, with the drones at the best
    stand found for a target at each place: the planner's, or one from which it starts. Places whose stand the planner
    would leave are counted. Errors of simulated flights were 0.7 to 0.8 of the figures. The warnings of `config check`
    come first.
    """
    from groundstation.cli.kernels import use_flying_kernels
    from groundstation.settings.files import find_field
    from groundstation.settings.load import cautions_of, load_field
    from groundstation.settings.resolved import resolved_field

    if drawn and scenario:
        raise click.UsageError("--path and --scenario both name a path: give one of them")
    if output is not None and output.suffix not in (*_PICTURES, ".html"):
        raise click.UsageError(f"--output {output}: must end in .svg, .png, .pdf or .html")
    path = find_field(field)
    settings = load_field(path, options)
    target = _target(settings, target)
    paths = _paths(settings, path, target, drawn, scenario)
    warnings = cautions_of(path, options)
    if not as_json:
        _warn(warnings)
    use_flying_kernels()
    from groundstation.forecast.forecast import forecast as forecast_of

    began = time.process_time()
    found = forecast_of(resolved_field(settings), paths[target], progress, target)
    spent_s = time.process_time() - began
    if as_json:
        from groundstation.forecast.plain import plain

        click.echo(json.dumps({"warnings": warnings, **plain(found)}))
    else:
        _tell(found)
    if spent_s > _LONG_S:
        click.echo(f"this took {spent_s:.0f} s of computing: large teams and many cameras take long", err=True)
    if output is not None:
        _write(found, warnings, settings, paths, output)


def _target(settings: "Field", named: str | None) -> str:
    names = list(settings.tracked)
    if named is not None and named not in names:
        raise SettingsError([f"--target: the field has no target {named!r}; it has {', '.join(names)}"])
    return named or names[0]


def _paths(settings: "Field", path: Path, target: str, drawn: str | None, scenario: str | None) -> "Paths":
    """Return the known paths of the targets."""
    from groundstation.settings import drawing
    from groundstation.settings.files import find_scenario
    from groundstation.settings.scenario import load_scenario

    names = list(settings.tracked)
    paths: Paths = {name: [] for name in names}
    if drawn is not None:
        paths[target] = _places(drawn)
    elif scenario:
        paths = drawing.paths_of(load_scenario(find_scenario(scenario, path)), names)
        if not paths[target]:
            click.echo(
                f"{scenario}: no fixed path of {target}: the floor alone is forecast; --path names one", err=True
            )
    where = "--path" if drawn else str(scenario)
    if beyond := drawing.beyond_walls(settings, paths):
        raise SettingsError([f"{where}: {sentence}" for sentence in beyond])
    return paths


def _places(text: str) -> list[tuple[float, float]]:
    places = []
    for word in text.split():
        try:
            x, y = (float(part) for part in word.split(","))
        except ValueError:
            raise SettingsError([f"--path: {word!r} is no place; {_SHOWN}"]) from None
        if not math.isfinite(x) or not math.isfinite(y):
            raise SettingsError([f"--path: {word!r} is no place; {_SHOWN}"])
        places.append((x, y))
    if not places:
        raise SettingsError([f"--path: names no place; {_SHOWN}"])
    return places


def _warn(warnings: list[str]) -> None:
    for line in warnings:
        click.echo(click.wrap_text(f"WARNING: {line}", _WIDTH, subsequent_indent="  "))
    if warnings:
        click.echo()


def _tell(found: "Forecast") -> None:
    from rich.markup import escape
    from rich.table import Table

    from groundstation.forecast.wording import sections_of

    for section in sections_of(found):
        click.echo(click.style(section.title, bold=True), with_sequences(sys.stdout))
        if section.rows:
            table = Table(
                *map(escape, section.head), box=None, header_style="dim", pad_edge=False, padding=(0, 2, 0, 0)
            )
            for row in section.rows:
                table.add_row(*map(escape, row))
            show(table)
        for note in section.notes:
            click.echo(click.wrap_text(note, _WIDTH, subsequent_indent="  "))
        click.echo()


def _write(found: "Forecast", warnings: list[str], settings: "Field", paths: "Paths", output: Path) -> None:
    from groundstation.recording.outputs import replaced_file
    from groundstation.settings.drawing import Shade, draw, svg_of

    floor = found.floor
    shade = Shade(floor.xs, floor.ys, floor.std_m, f"deviation of {found.team.target} [m]")
    if output.suffix == ".html":
        from groundstation.forecast.page import page
        from groundstation.forecast.wording import sections_of

        title = f"Forecast of {settings.site}"
        text = page(title, warnings, sections_of(found), svg_of(settings, paths, shade))
        with replaced_file(output) as partial:
            partial.write_text(text, encoding="utf-8")
    else:
        with replaced_file(output) as partial:
            draw(settings, partial, paths, shade)
    click.echo(f"wrote {output}", err=True)
