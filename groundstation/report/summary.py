"""The report as printed at the end of a run."""

from rich.console import Group, JustifyMethod, RenderableType
from rich.table import Table
from rich.text import Text

from groundstation.appearance.plain_text import one_line
from groundstation.appearance.topology import topology_words
from groundstation.recording.part_names import shown
from groundstation.report.compare import differences, labels
from groundstation.report.criteria import Criterion
from groundstation.report.file_names import HTML_NAME, JSON_NAME, PLOT_NAME
from groundstation.report.happenings import Happening
from groundstation.report.judge import RunReport
from groundstation.report.wording import KIND_WORDS, bound, quantity, title

_HAPPENINGS_SHOWN = 12
_DOUBTS_SHOWN = 3
# Healthy flights have 0.4 to 2.9.
_FAR_TOO_SURE = 4.0


def summary(report: RunReport) -> RenderableType:
    """Return verdict, criteria and main findings, for rich to print."""
    parts: list[RenderableType] = [_verdict(report)]
    if report.criteria:
        parts.append(_criteria(report.criteria))
    parts.append(_details(report))
    parts += _happenings(report.findings.happenings)
    parts += [Text(f"  doubt: {doubt}", style="yellow") for doubt in report.findings.trust.doubts[:_DOUBTS_SHOWN]]
    for line in report.figures.loud_events[-5:]:
        parts.append(Text(f"  {one_line(line)}", style="yellow"))
    for line in report.damage[:3]:
        parts.append(Text(f"  recording: {line}", style="dim"))
    parts.append(Text(f"  {shown(report.run_dir)}: {HTML_NAME}, {JSON_NAME}, {PLOT_NAME}", style="dim"))
    return Group(*parts)


def comparison(first: RunReport, second: RunReport) -> RenderableType:
    """Return the figures of two runs beside each other, for rich to print."""
    table = Table(box=None, pad_edge=True, header_style="dim")
    table.add_column("figure", no_wrap=True)
    for head in (*labels(first, second), "change"):
        table.add_column(head, justify="right")
    for row in differences(first, second):
        table.add_row(
            title(row.figure),
            *("–" if value is None else quantity(row.figure, value) for value in (row.first, row.second, row.change)),
        )
    names = f" first: {first.name}, second: {second.name}"
    notes = [
        Text(f" {label}: {report.no_flight.sentence}", style="bold yellow")
        for label, report in (("first", first), ("second", second))
        if report.no_flight
    ]
    return Group(Text(names, style="dim"), *notes, table)


def _verdict(report: RunReport) -> Text:
    if report.no_flight is not None:
        return Text(
            f"{report.verdict.upper()}{report.no_flight.sentence.removeprefix(report.verdict)}", style="bold yellow"
        )
    if report.passed:
        return Text("PASSED", style="bold green")
    if not report.valid:
        remedy = "close other programs, see what `groundstation doctor` says of this computer, and repeat"
        return Text(f"INVALID: {'; '.join(report.reasons)}; {remedy}", style="bold red")
    return Text(f"FAILED: {'; '.join(report.reasons)}", style="bold red")


def _criteria(criteria: tuple[Criterion, ...]) -> Table:
    table = Table(box=None, pad_edge=True, header_style="dim")
    columns: dict[str, JustifyMethod] = {"": "left", "criterion": "left", "value": "right", "limit": "left"}
    for head, justify in columns.items():
        table.add_column(head, justify=justify)
    for criterion in criteria:
        mark = Text("ok", style="green") if criterion.ok else Text("NO", style="bold red")
        table.add_row(mark, title(criterion.name), quantity(criterion.name, criterion.value), bound(criterion))
    return table


def _details(report: RunReport) -> Text:
    figures = report.figures
    seconds = ", ".join(
        f"{topology_words(text)} {value:.0f} s"
        for text, value in figures.topology_seconds.items()
        if text not in KIND_WORDS and value >= 0.5
    )
    busiest = sorted(figures.cpu_cores.items(), key=lambda item: -item[1])[:4]
    cores = ", ".join(f"{name} {share:.0%}" for name, share in busiest)
    lines = [f"topologies: {seconds or 'none'}; {figures.topology_switches} switches", f"cpu: {cores or 'unknown'}"]
    for name, target in figures.targets.items():
        if target.anees is not None:
            label = "target" if len(figures.targets) == 1 else f"{name}: rms error {target.rmse_m:.3f} m"
            lines.append(f"{label}: covered {target.covered:.0%}, normalised error {target.anees:.2f} (1 is ideal)")
            if target.judged < 1.0:
                lines.append(f"  judged for {target.judged:.0%} of the time: the truth is not known for the rest")
            if target.anees > _FAR_TOO_SURE:
                lines.append("  a figure of the field may be wrong: groundstation calibrate team looks for it")
    return Text("\n".join(f"  {line}" for line in lines))


def _happenings(found: list[Happening]) -> list[RenderableType]:
    """Return the first faults and reactions, and the number of further ones."""
    lines: list[RenderableType] = [
        Text(f"  {one_line(item.line)}", style="red" if item.ended_flight else "yellow")
        for item in found[:_HAPPENINGS_SHOWN]
    ]
    if len(found) > _HAPPENINGS_SHOWN:
        lines.append(Text(f"  {len(found) - _HAPPENINGS_SHOWN} more: {HTML_NAME}, Safety", style="dim"))
    return lines
