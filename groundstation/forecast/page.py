"""A forecast as one page of HTML that needs no network."""

from collections.abc import Iterable
from html import escape

from groundstation.forecast.wording import Section

_STYLE = (
    "body{font:15px/1.5 sans-serif;max-width:60rem;margin:2rem auto;padding:0 1rem}"
    "td,th{text-align:left;padding:.15rem 1rem .15rem 0;vertical-align:top}svg{max-width:100%;height:auto}"
)


def page(title: str, warnings: Iterable[str], sections: Iterable[Section], svg: str) -> str:
    """Return the page of warnings about the field and of some sections, the map after the first."""
    first, *rest = [_section(one) for one in sections]
    drawn = svg[svg.index("<svg") :]
    warned = (f"<p><strong>WARNING: {escape(line)}</strong></p>" for line in warnings)
    body = "\n".join([f"<h1>{escape(title)}</h1>", *warned, first, drawn, *rest])
    head = f'<meta charset="utf-8"><title>{escape(title)}</title><style>{_STYLE}</style>'
    return f'<!doctype html>\n<html lang="en"><head>{head}</head><body>\n{body}\n</body></html>\n'


def _section(section: Section) -> str:
    lines = [f"<h2>{escape(section.title)}</h2>"]
    if section.rows:
        lines.append(f"<table>{_row(section.head, 'th')}{''.join(_row(row, 'td') for row in section.rows)}</table>")
    lines += [f"<p>{escape(note)}</p>" for note in section.notes]
    return "\n".join(lines)


def _row(cells: Iterable[str], tag: str) -> str:
    return "<tr>" + "".join(f"<{tag}>{escape(cell)}</{tag}>" for cell in cells) + "</tr>"
