"""The section of a run's page on the trustworthiness of its figures."""

from html import escape

from groundstation.report.page.tables import number, table
from groundstation.report.trust import Trust

_NOTE = (
    "NIS is the squared difference between what a sensor said and what was expected, by how large it should be: "
    "1 is ideal, more means that the estimate was too sure of itself. "
    "Its interval allows for errors that repeat within two seconds."
)


def trust_section(trust: Trust) -> str:
    """Return the doubts with their remedies, and the tables from which they follow."""
    if trust.doubts:
        verdict = "<ul>" + "".join(f"<li>{escape(doubt)}</li>" for doubt in trust.doubts) + "</ul>"
    else:
        verdict = "<p>No reason to doubt them.</p>"
    return verdict + _sensors(trust) + _figures(trust) + _links(trust) + f'<p class="dim">{_NOTE}</p>'


def _sensors(trust: Trust) -> str:
    rows = [
        (one.observer, one.observations, number(one.nis_per_dof, 2), f"{number(one.low, 2)} … {number(one.high, 2)}",
         f"{one.refused_percent:.1f} %", one.verdict)
        for one in trust.sensors
    ]  # fmt: skip
    head = ("sensor", "observations", "NIS per dof", "95 % interval", "refused", "verdict")
    return table(head, rows, "No observation reached the filter.")


def _figures(trust: Trust) -> str:
    units = {"position": ("m", 3), "attitude": ("deg", 2)}
    rows = [
        (f"{one.what} of {one.camera}", f"{one.by:.{units[one.what][1]}f} {units[one.what][0]}",
         f"{one.survey_std:g} {units[one.what][0]}", f"{one.sigmas:.1f}")
        for one in trust.shifts
    ]  # fmt: skip
    rows += [
        (f"delay of {one.camera}", f"{one.offset_ms:.0f} ms", f"{one.std_ms:.0f} ms (of the estimate)",
         f"{abs(one.offset_ms) / one.std_ms:.1f}" if one.std_ms else "–")
        for one in trust.delays
    ]  # fmt: skip
    head = ("figure of the field file", "moved by", "standard deviation", "in standard deviations")
    return table(head, rows, "No figure of the field file was estimated in flight.")


def _links(trust: Trust) -> str:
    rows = [
        (f"{one.observer} → {one.subject}", f"{one.planned_s:.0f} s", f"{one.seen_percent:.0f} %")
        for one in trust.links
    ]
    return table(("planned link", "planned for", "of that it saw"), rows, "No plan counted on any link.")
