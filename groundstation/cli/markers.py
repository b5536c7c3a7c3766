"""`groundstation markers`: markers on paper."""

import re
from pathlib import Path

import click

from groundstation.geometry.tag import SquareTag
from groundstation.printing import pdf, sheets
from groundstation.recording.outputs import replaced_file

_SQUARE_MM, _TAG_MM = 44.0, 168.0


@click.group(epilog="Example: groundstation markers print --id 3 --size A4 -o marker.pdf")
def markers() -> None:
    """Print the markers that robots and targets carry."""


@markers.command(
    name="print",
    epilog="\b\nExamples:\n  groundstation markers print --id 3 --size A4 -o marker.pdf\n"
    "  groundstation markers print --id 1 --id 2 --id 5 --square-mm 60 --size A3 -o team.pdf\n"
    "  groundstation markers print --dictionary DICT_APRILTAG_36H11 --id 7 --size-mm 168 -o tag.pdf",
)
@click.option("--id", "ids", type=int, multiple=True, required=True, help="Code (0..15), or id of a tag; repeatable.")
@click.option(
    "--size", "paper", default="A4", show_default=True, help="Paper: A5..A0, Letter, Tabloid, or 300x400 (mm)."
)
@click.option("--square-mm", type=float, help=f"Side of one square of the checkerboard.  [default: {_SQUARE_MM:g}]")
@click.option(
    "--dictionary", metavar="NAME", help="Print tags of this ArUco, AprilTag or plug-in's dictionary instead."
)
@click.option("--size-mm", type=float, help=f"Side of a tag's black square.  [default: {_TAG_MM:g}]")
@click.option(
    "-o", "--output", type=click.Path(path_type=Path, dir_okay=False), required=True, help="The PDF to write."
)
def print_markers(
    ids: tuple[int, ...],
    paper: str,
    square_mm: float | None,
    dictionary: str | None,
    size_mm: float | None,
    output: Path,
) -> None:
    """Write a PDF of exact scale: a page of notes with a scale to check, then one marker per page."""
    if dictionary is None and size_mm is not None:
        raise click.UsageError("--size-mm: belongs to tags (--dictionary); squares have --square-mm")
    if dictionary is not None and square_mm is not None:
        raise click.UsageError("--square-mm: tags have no squares; use --size-mm")
    if output.suffix.lower() != ".pdf":
        raise click.UsageError(f"--output {output}: must end in .pdf")
    sheet = paper_size(paper)
    given, usual = (square_mm, _SQUARE_MM) if dictionary is None else (size_mm, _TAG_MM)
    size = usual if given is None else given
    items = [_item(number, dictionary, size) for number in dict.fromkeys(ids)]
    pages = []
    for number, item in zip(dict.fromkeys(ids), items, strict=True):
        try:
            pages.append(sheets.page(item, sheet))
        except ValueError as error:
            fitting = sheets.largest(size, item, sheet)
            name = "--square-mm" if dictionary is None else "--size-mm"
            hint = f"at most {name} {fitting:g} fits; or take a larger --size" if fitting else "take a larger --size"
            raise click.UsageError(f"marker {number} with {size:g} mm {error}: {hint}") from None
    title = f"Skein markers {', '.join(str(number) for number in dict.fromkeys(ids))}"
    with replaced_file(output) as partial:
        partial.write_bytes(pdf.encode([sheets.notes(items, sheet), *pages], title))
    click.echo(f"{output}: {len(pages)} marker(s) and a page of notes; print at 100 % and check the scale", err=True)


def paper_size(text: str) -> tuple[float, float]:
    """Return width and height [mm] of a paper's name or of `WxH`; raises UsageError."""
    named = {name.lower(): size for name, size in sheets.PAPERS.items()}.get(text.lower())
    if named is not None:
        return named
    sides = re.fullmatch(r"(\d{2,4}(?:\.\d+)?)[xX](\d{2,4}(?:\.\d+)?)", text)
    if sides is None:
        raise click.UsageError(
            f"--size {text}: is none of {', '.join(sheets.PAPERS)}, nor WIDTHxHEIGHT in mm such as 300x400"
        )
    return float(sides[1]), float(sides[2])


def _item(number: int, dictionary: str | None, size: float) -> sheets.Sheet:
    from groundstation.settings.marker import TAGS_MM
    from groundstation.settings.values import SQUARES_MM

    least, most = SQUARES_MM if dictionary is None else TAGS_MM
    if not least <= size <= most:
        raise click.UsageError(f"a size of {size:g} mm: must be in {least:g}..{most:g}, as a field file permits")
    try:
        if dictionary is None:
            return sheets.checkerboard(number, size)
        from drivers.camera.dictionaries import black_cells

        marker = SquareTag(dictionary, number, size)
        return sheets.tag(marker, black_cells(marker))
    except ValueError as error:
        raise click.UsageError(f"marker {number}: {error}") from None
