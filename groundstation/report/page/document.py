"""report.html: verdict, room, charts and tables of one run in one file that needs no network."""

import re
from html import escape
from io import StringIO
from pathlib import Path

import matplotlib as mpl
import msgspec
from matplotlib.figure import Figure

from groundstation.report.interval import tracking_interval
from groundstation.report.judge import RunReport
from groundstation.report.moment_pictures import MomentPicture, moment_pictures
from groundstation.report.page import tables
from groundstation.report.page.chart import Chart
from groundstation.report.page.flight_charts import flight_charts
from groundstation.report.page.health_charts import health_charts
from groundstation.report.page.inline import script, style
from groundstation.report.page.trust_section import trust_section
from groundstation.report.plot_map import draw_map
from groundstation.report.plot_searches import draw_searches
from groundstation.report.plot_style import STYLE
from groundstation.report.searches import searches
from groundstation.report.story import story
from groundstation.report.tracks import RunData

_SVG = {**STYLE, "svg.fonttype": "path", "path.simplify_threshold": 0.5, "svg.hashsalt": "skein"}


def write_page(data: RunData, report: RunReport, path: Path) -> None:
    """Write the page of a run."""
    start_s, end_s = tracking_interval(data) or (0.0, max(data.end_s, 1.0))
    findings, moments = report.findings, story(data)
    flight, health = flight_charts(data, start_s, end_s), health_charts(data, start_s, end_s)
    sections = [
        ("Verdict", tables.criteria_table(report) + tables.accuracy_table(report)),
        ("Is it to be trusted?", trust_section(findings.trust)),
        ("What happened", tables.story_table(moments) + _pictures(moment_pictures(report.run_dir, data, moments))),
        ("Room", f'<div class="map">{_room(data)}</div>'),
        ("Searches", _searches(data)),
        ("Flight", holders(flight, 0)),
        ("Topology", tables.switches_table(findings)),
        ("Consistency", holders(health, len(flight)) + tables.edges_table(findings)),
        ("Safety", tables.happenings_table(findings) + tables.interventions_table(findings)),
        ("Links and timing", tables.links_table(findings) + tables.processes_table(data)),
        ("Events", tables.events_table(data)),
        ("Damage", _damage(report)),
    ]
    told = [(name, content) for name, content in sections if content]
    path.write_text(page(report.name, _lead(report), told, [*flight, *health]), encoding="utf-8")


def page(title: str, lead: str, sections: list[tuple[str, str]], charts: list[Chart]) -> str:
    """Return a whole page; `lead` and the sections are HTML, each chart is drawn in the holder with its number."""
    # Inside a script element only this sequence can end it.
    data = msgspec.json.encode(charts).decode().replace("</", "<\\/")
    links = "".join(f'<a href="#s{index}">{escape(name)}</a>' for index, (name, _) in enumerate(sections))
    body = "".join(
        f'<section id="s{index}"><h2>{escape(name)}</h2>{content}</section>'
        for index, (name, content) in enumerate(sections)
    )
    return (
        f'<!doctype html><html lang="en"><head><meta charset="utf-8"><title>{escape(title)}</title>'
        f'<meta name="viewport" content="width=device-width, initial-scale=1"><style>{style()}</style></head>'
        f"<body><header><h1>{escape(title)}</h1>{lead}<nav>{links}</nav></header><main>{body}</main>"
        f'<script type="application/json" id="charts">{data}</script><script>{script()}</script></body></html>\n'
    )


def holders(charts: list[Chart], first: int) -> str:
    """Return the HTML elements in which charts are drawn, numbered from `first` on."""
    return "".join(
        f"<figure><figcaption><b>{escape(chart.title)}</b> {escape(f'[{chart.unit}]' if chart.unit else '')} "
        f'<span class="dim">{escape(chart.note)}</span></figcaption>'
        f'<div class="chart" data-chart="{first + index}"></div></figure>'
        for index, chart in enumerate(charts)
    )


def _lead(report: RunReport) -> str:
    verdict = report.verdict
    facts = report.facts
    known = {
        "mode": facts.mode, "field": facts.field, "scenario": facts.scenario,
        "seed": "" if facts.seed is None else str(facts.seed), "tracked": f"{report.figures.tracked_s:.0f} s",
    }  # fmt: skip
    words = " · ".join(f"{name} {escape(value)}" for name, value in known.items() if value)
    why = f" {report.invalid[0].upper()}{report.invalid[1:]}: the figures mean nothing." if report.invalid else ""
    if report.rerun or report.stretch:
        words = f"recorded flight: {words}"
    style = verdict.replace(" ", "-")
    badge = f'<p><span class="verdict {style}">{verdict.upper()}</span> <span class="dim">{words}.{why}</span></p>'
    return badge + _reasons(report) + no_flight_note(report)


def _reasons(report: RunReport) -> str:
    """Return the reasons for a run's failure, in words, "" if it passed; without what makes it invalid, said above."""
    return "".join(f"<p>{escape(reason)}.</p>" for reason in report.reasons if reason != report.invalid)


def _pictures(pictures: list[MomentPicture]) -> str:
    """Return a strip of pictures, each with its moment, "" without any."""
    figures = "".join(
        f'<figure><img src="{one.uri}" alt="{escape(one.camera)} at {one.moment.time_s:.1f} s">'
        f"<figcaption><b>{one.moment.time_s:.1f} s</b> {escape(one.moment.text)} "
        f'<span class="dim">{escape(one.camera)}</span></figcaption></figure>'
        for one in pictures
    )
    return f'<div class="moments">{figures}</div>' if figures else ""


def no_flight_note(report: RunReport) -> str:
    """Return the note that marks a re-run, a cut or a run in which nobody flew, "" for a flight."""
    if report.no_flight is None:
        return ""
    told = report.not_flown.told_of if report.not_flown else f"is a {report.no_flight.sentence}"
    return f'<p class="rerun"><b>{escape(report.name)}</b> {escape(told)}.</p>'


def _room(data: RunData) -> str:
    with mpl.rc_context(_SVG):
        figure = Figure(figsize=(11.4, 6.2), layout="constrained")
        draw_map(figure.add_subplot(), data)
        return _svg(figure)


def _searches(data: RunData) -> str:
    """Return the maps of the longest searches with their captions, "" without any."""
    if not data.search_maps:
        return ""
    found = searches(data.search_maps)
    with mpl.rc_context({**_SVG, "axes.grid": False}):
        maps = _svg(draw_searches(data, found))
    lines = "".join(
        f"<li>{escape(one.target)} was searched for from {one.begin_s:.1f} s to {one.end_s:.1f} s</li>" for one in found
    )
    note = "The darker a cell, the likelier the target is there. Dots: drones, and where they look; cross: the truth."
    return f'<ul>{lines}</ul><p class="dim">{note}</p><div class="map">{maps}</div>'


def _damage(report: RunReport) -> str:
    """Return the parts of the recording that could not be read, "" if there are none."""
    lines = "".join(f"<li>{escape(line)}</li>" for line in report.damage)
    return f"<ul>{lines}</ul>" if lines else ""


def _svg(figure: Figure) -> str:
    text = StringIO()
    figure.savefig(text, format="svg", metadata={"Date": None, "Creator": None})
    svg = text.getvalue()
    return _without_styles(svg[svg.index("<svg") :])


def _without_styles(svg: str) -> str:
    """Return a drawing with attributes instead of inline styles, which the console forbids in reports."""
    svg = re.sub(r"<style[^>]*>.*?</style>", "", svg, flags=re.DOTALL)
    svg = svg.replace("<svg ", '<svg stroke-linejoin="round" stroke-linecap="butt" ', 1)  # as that style had it
    return re.sub(r' style="([^"]*)"', lambda found: _attributes(found[1]), svg)


def _attributes(style_of: str) -> str:
    pairs = (part.split(":", 1) for part in style_of.split(";") if part.strip())
    return "".join(f' {name.strip()}="{value.strip()}"' for name, value in pairs)
