"""Tables of the page as HTML; every text from a recording is escaped here."""

from collections.abc import Iterable, Sequence
from html import escape

from groundstation.appearance.cost import COST_UNIT, cost_figure
from groundstation.appearance.topology import topology_words
from groundstation.report.criteria import Value
from groundstation.report.findings import Findings
from groundstation.report.judge import RunReport
from groundstation.report.load import process_loads
from groundstation.report.story import Moment
from groundstation.report.tracks import RunData
from groundstation.report.wording import bound, quantity, title

_EVENTS_SHOWN = 500
_BAD = frozenset({"MISSED", "ERROR", "error", "failsafe", "failed", "invalid"})
_WARNED = frozenset({"WARNING", "warning", "fault"})


def table(head: Sequence[str], rows: Iterable[Sequence[object]], empty: str) -> str:
    """Return a table, or the sentence `empty` when there is no row."""
    body = "".join(f"<tr>{''.join(_cell(value) for value in row)}</tr>" for row in rows)
    if not body:
        return f'<p class="dim">{escape(empty)}</p>'
    heads = "".join(f"<th>{escape(name)}</th>" for name in head)
    # Reached by the Tab key, so that a wide table can be scrolled without a mouse.
    opening = f'<div class="scroll" tabindex="0" role="group" aria-label="{escape(" and ".join(head[:2]))}">'
    return f"{opening}<table><thead><tr>{heads}</tr></thead><tbody>{body}</tbody></table></div>"


def number(value: Value, digits: int = 3) -> str:
    """Return a value as text: yes and no, a dash if it was not measured."""
    if value is None:
        return "–"
    if isinstance(value, bool):
        return "yes" if value else "no"
    rounded = round(float(value), digits) + 0.0  # no "-0"
    return f"{rounded:.{digits}f}".rstrip("0").rstrip(".") if digits else f"{rounded:.0f}"


def criteria_table(report: RunReport) -> str:
    """Return verdict, value and limit of each criterion."""
    rows = [
        ("met" if item.ok else "MISSED", title(item.name), quantity(item.name, item.value), bound(item), item.why)
        for item in report.criteria
    ]  # fmt: skip
    kind = report.no_flight.kind if report.no_flight else ""
    empty = f"A {kind} is no flight: no criterion applies." if kind else "No criterion applies."
    if report.not_flown:
        empty = "No drone flew: no criterion applies."
    return table(("verdict", "criterion", "value", "asked for", "why"), rows, empty)


def accuracy_table(report: RunReport) -> str:
    """Return errors and consistency of every entity over the tracking interval."""
    entities = {**report.figures.targets, **report.figures.robots}
    rows = [
        (name, number(item.rmse_m), number(item.max_error_m), number(item.lost_s, 1), f"{item.covered:.0%}",
         number(item.anees, 2), "–" if item.yaw_rmse_rad is None else f"{item.yaw_rmse_rad * 57.29578:.1f}")
        for name, item in entities.items() if item is not None
    ]  # fmt: skip
    against = f"entity (truth: {report.figures.truth})" if report.figures.truth else "entity"
    head = (against, "rms error [m]", "largest [m]", "lost [s]", "covered", "NEES per dof", "yaw rms [deg]")
    return table(head, rows, "The recording holds no ground truth: errors are unknown.")


def edges_table(findings: Findings) -> str:
    """Return NIS with bounds, verdicts and latency of each observer and subject."""
    rows = [
        (f"{edge.observer} → {edge.subject}", edge.count, number(edge.nis_per_dof, 2),
         f"{number(edge.low, 2)} … {number(edge.high, 2)}", f"{edge.inflated_percent:.1f} %", _counts(edge.refused),
         f"{edge.latency_p50_ms:.0f} / {edge.latency_p99_ms:.0f}")
        for edge in findings.edges
    ]  # fmt: skip
    head = ("edge", "observations", "NIS per dof", "95 % bounds", "inflated", "refused", "latency p50 / p99 [ms]")
    return table(head, rows, "No observation reached the filter.")


def switches_table(findings: Findings) -> str:
    """Return each change of topology with the costs of both sides."""
    rows = [
        (f"{item.time_s:.1f}", topology_words(item.before), topology_words(item.after), cost_figure(item.cost),
         "–" if item.stay_cost is None else cost_figure(item.stay_cost), item.reason)
        for item in findings.switches
    ]  # fmt: skip
    head = ("time [s]", "from", "to", f"cost [{COST_UNIT}]", f"cost of staying [{COST_UNIT}]", "reason")
    return table(head, rows, "The topology never changed.")


def interventions_table(findings: Findings) -> str:
    """Return the interventions of safety by robot and cause."""
    rows = [
        (item.robot, item.cause, item.episodes, item.plans, number(item.longest_s, 1), number(item.most_cut_m_s, 2))
        for item in findings.interventions
    ]
    head = ("robot", "cause", "episodes", "plans", "longest [s]", "most cut [m/s]")
    return table(head, rows, "Safety never changed a velocity.")


def happenings_table(findings: Findings) -> str:
    """Return faults of the scenario and reactions of failsafes, beside each other in order of time."""
    rows = [(f"{item.time_s:.1f}", item.entity, item.cause, item.text) for item in findings.happenings]
    return table(("time [s]", "about", "cause", "what"), rows, "No fault was injected, and no failsafe acted.")


def story_table(moments: Sequence[Moment]) -> str:
    """Return the story of the run, a line for each moment."""
    rows = [(f"{item.time_s:.1f}", item.kind, item.text) for item in moments[:_EVENTS_SHOWN]]
    return table(("time [s]", "kind", "what happened"), rows, "Nothing happened.") + _left_out(moments)


def links_table(findings: Findings) -> str:
    """Return the quality of the links to the vehicles."""
    rows = [
        (item.vehicle, number(item.rate_hz_p50, 1), number(item.rate_hz_min, 1), number(item.longest_silence_s, 2),
         number(item.link_quality_min, 2), _battery(item.battery),
         _counts(item.rejected))
        for item in findings.links
    ]  # fmt: skip
    head = (
        "vehicle",
        "telemetry p50 [Hz]",
        "least [Hz]",
        "longest silence [s]",
        "least link quality",
        "battery",
        "refused",
    )
    return table(head, rows, "No vehicle reported.")


def processes_table(data: RunData) -> str:
    """Return processor use and deadlines of each process."""
    rows = [
        (load.name, f"{load.cores:.1%}", load.ticks, load.missed, load.overflowed, load.restarts)
        for load in process_loads(data)
    ]
    head = ("process", "of one core", "ticks", "missed deadlines", "messages lost in queues", "restarts")
    return table(head, rows, "No process reported.")


def events_table(data: RunData) -> str:
    """Return commands, and events with their remedies, in order of time."""
    rows = [
        (item.time_s, str(item.message.severity), item.message.header.entity, item.message.text, item.message.remedy)
        for item in data.events
    ]
    rows += [
        (
            item.time_s,
            "COMMAND",
            ", ".join(item.message.scope) or "team",
            str(item.message.verb),
            f"by {item.message.issuer}",
        )
        for item in data.commands
    ]
    rows.sort(key=lambda row: row[0])
    shown = [(f"{row[0]:.1f}", *row[1:]) for row in rows[:_EVENTS_SHOWN]]
    return table(("time [s]", "severity", "about", "what", "remedy"), shown, "Nothing happened.") + _left_out(rows)


def _left_out(rows: Sequence[object]) -> str:
    """Return the note on rows of a long table that are not shown, "" if all are."""
    more = len(rows) - _EVENTS_SHOWN
    return f'<p class="dim">{more} more are in the recording.</p>' if more > 0 else ""


def _battery(ends: tuple[float, float] | None) -> str:
    return "–" if ends is None else f"{ends[0]:.0%} → {ends[1]:.0%}"


def _counts(counts: dict[str, int]) -> str:
    return ", ".join(f"{reason} {count}" for reason, count in sorted(counts.items())) or "–"


def _cell(value: object) -> str:
    text = str(value)
    loud = ' class="bad"' if text in _BAD else ' class="warn"' if text in _WARNED else ""
    return f"<td{loud}>{escape(text)}</td>"
