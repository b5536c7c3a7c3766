"""The events of a run, by time: orders, flights, topologies, warnings, faults and failsafes. Pure."""

from collections.abc import Iterator

import msgspec

from groundstation.appearance.topology import topology_words
from groundstation.bus.messages import UP, FlightState, Severity
from groundstation.report.decisions import switches
from groundstation.report.happenings import happenings
from groundstation.report.interval import tracking_interval
from groundstation.report.tracks import RunData

_LOUD = frozenset({Severity.WARNING, Severity.ERROR})
_MARKS = {Severity.WARNING: "warning", Severity.ERROR: "error"}


class Moment(msgspec.Struct, frozen=True):
    """One line of the story. kind: order, flight, topology, fault, failsafe, warning or error."""

    time_s: float
    kind: str
    text: str


def story(data: RunData) -> list[Moment]:
    """Return the moments of a run in order of time; repetitions of the same event are left out."""
    found = [*_orders(data), *_flights(data), *_tracking(data), *_topologies(data), *_reactions(data), *_warnings(data)]
    kept: dict[tuple[str, str], Moment] = {}
    for moment in sorted(found, key=lambda item: item.time_s):
        repeats = moment.kind in ("warning", "error")
        kept.setdefault((moment.kind, moment.text if repeats else f"{moment.text} {moment.time_s}"), moment)
    return list(kept.values())


def _orders(data: RunData) -> Iterator[Moment]:
    for item in data.commands:
        whom = ", ".join(item.message.scope) or "the team"
        yield Moment(item.time_s, "order", f"{item.message.issuer} orders {item.message.verb} for {whom}")


def _flights(data: RunData) -> Iterator[Moment]:
    for drone, statuses in data.vehicles.items():
        up = False
        for item in sorted(statuses, key=lambda status: status.time_s):
            state = item.message.flight_state
            if not up and state in UP:
                up = True
                yield Moment(item.time_s, "flight", f"{drone} is in the air")
            elif up and state is FlightState.LANDED:
                up = False
                yield Moment(item.time_s, "flight", f"{drone} has landed")


def _tracking(data: RunData) -> Iterator[Moment]:
    interval = tracking_interval(data)
    if interval:
        yield Moment(interval[0], "flight", "tracking begins")


def _topologies(data: RunData) -> Iterator[Moment]:
    for item in switches(data):
        yield Moment(item.time_s, "topology", f"topology {topology_words(item.after)}: {item.reason}")


def _reactions(data: RunData) -> Iterator[Moment]:
    for item in happenings(data):
        kind = "fault" if item.cause == "fault" else "failsafe"
        yield Moment(item.time_s, kind, f"{item.entity}: {item.text}")


def _warnings(data: RunData) -> Iterator[Moment]:
    for item in data.events:
        if item.message.severity in _LOUD and not item.message.injected:
            about, said = item.message.header.entity, item.message.text
            text = said if said.startswith(about) else f"{about}: {said}"
            yield Moment(item.time_s, _MARKS[item.message.severity], text)
