"""Renders the state with rich. Pure: the same state and time give the same picture."""

from collections.abc import Iterator
from dataclasses import dataclass

from rich.console import Console, ConsoleOptions, Group, RenderableType, RenderResult
from rich.table import Table
from rich.text import Text

from groundstation.appearance.cost import cost_text
from groundstation.appearance.plain_text import one_line
from groundstation.appearance.topology import topology_words
from groundstation.bus.messages import OPERATOR, AckStage, Event, Lifecycle, Severity
from groundstation.control.unseen_targets import TELL_AFTER_S, unseen_words
from groundstation.monitor.alarms import alarms_of
from groundstation.monitor.batteries import Charge, battery_of
from groundstation.monitor.state import MonitorState, StampedMessage
from groundstation.monitor.whereabouts import ellipse_m, is_anywhere

_SEEN_S = 0.6
_EVENTS = 6
_ALARMS = 5
_COMMAND_SHOWN_S = 10.0
_MODE, _POSITION, _ELLIPSE, _SEEN_BY = "mode", "position [m]", "95 % ellipse\n[m]", "seen by"
_COLUMNS = ("", _MODE, "vehicle", "battery", "link", "age", _POSITION, _ELLIPSE, _SEEN_BY)
# Columns that a narrow terminal omits, in this order: alarms report failing links.
_SPARED = ("vehicle", "link", _ELLIPSE, _SEEN_BY, "age", "battery", _POSITION)
_GAP, _AMPLE = 2, 10_000
_MODE_STYLES = {
    "TRACK": "bold green",
    "HOVER": "cyan",
    "HOLD": "yellow",
    "TAKING_OFF": "cyan",
    "LANDING": "yellow",
    "LANDED": "dim",
    "CONNECTING": "dim",
    "CUT": "bold red",
}
_STATE_STYLES = {
    Lifecycle.STARTING: "cyan",
    Lifecycle.READY: "green",
    Lifecycle.DEGRADED: "yellow",
    Lifecycle.STOPPING: "dim",
}


def render(state: MonitorState, now_ns: int) -> RenderableType:
    """Return the whole picture."""
    parts: list[RenderableType] = [_title(state, now_ns)]
    alarms = alarms_of(state, now_ns)
    for alarm in alarms[:_ALARMS]:
        parts.append(Text(f" {alarm.text} ", style="bold white on red" if alarm.grave else "black on yellow"))
    if more := alarms[_ALARMS:]:
        grave = sum(alarm.grave for alarm in more)
        parts.append(
            Text(f" and {len(more)} more, {grave} of them grave: the console's page has all ", style="reverse")
        )
    parts += [
        Text(),
        _Entities(state, now_ns),
        *_searches(state),
        *_unseen(state, now_ns),
        Text(),
    ]
    # Above the parts that grow with the team: a low window cuts the lines below.
    if state.command is not None and state.command.age_s(now_ns) < _COMMAND_SHOWN_S:
        parts.append(_command(state))
    parts.append(_plan(state, now_ns))
    if state.cameras:
        parts.append(_cameras(state, now_ns))
    parts += [_processes(state, now_ns), Text(), *_events(state, now_ns)]
    return Group(*(_plain(part) if isinstance(part, Text) else part for part in parts))


def _plain(text: Text) -> Text:
    text.plain = one_line(text.plain)
    return text


def _title(state: MonitorState, now_ns: int) -> Text:
    text = Text(f"skein  {state.cast.site}", style="bold")
    if state.started_ns:
        text.append(f"  {(now_ns - state.started_ns) / 1e9:.0f} s", style="not bold")
    if state.lease is not None and state.lease.message.expires_ns > now_ns:
        text.append(f"  operator {state.lease.message.holder}", style="not bold dim")
    text.append(f"  {state.hint}", style="not bold dim")
    return text


@dataclass(frozen=True, slots=True)
class _Entities:
    """Drones and targets, with as many columns as the terminal has room for; no text is shortened.

    The choice of columns depends only on data that are constant during a flight, so that none comes and goes.
    """

    state: MonitorState
    now_ns: int

    def __rich_console__(self, console: Console, options: ConsoleOptions) -> RenderResult:
        for spared in range(len(_SPARED) + 1):
            rigid = self._table((*_SPARED[:spared], _SEEN_BY))
            width = console.measure(rigid, options=options.update_width(_AMPLE)).maximum
            if width + self._observers_width(spared) <= options.max_width:
                break
        yield self._table(_SPARED[:spared])
        if spared:
            yield Text(f"too narrow for {', '.join(_SPARED[:spared])}".replace("\n", " "), style="dim")

    def _observers_width(self, spared: int) -> int:
        """Return the width for names of observers, one below the other if need be."""
        names = (*self.state.cast.drones, *self.state.cast.cameras, _SEEN_BY)
        return 0 if _SEEN_BY in _SPARED[:spared] else _GAP + max(len(name) + 1 for name in names)

    def _table(self, spared: tuple[str, ...]) -> Table:
        table = Table(box=None, pad_edge=False, header_style="dim", padding=(0, _GAP, 0, 0))
        kept = [index for index, title in enumerate(_COLUMNS) if title not in spared]
        for index in kept:
            title = _COLUMNS[index]
            table.add_column(
                Text(title),  # rich would take brackets in a plain string for markup
                justify="right" if 3 <= index <= 7 else "left",
                overflow="fold",
                no_wrap=len(kept) > 2 and title != _SEEN_BY,
                min_width=max(map(len, _MODE_STYLES)) if title == _MODE else None,
            )
        for row in self._rows():
            table.add_row(*(_plain(row[index]) for index in kept))
        return table

    def _rows(self) -> Iterator[tuple[Text, ...]]:
        state, now_ns = self.state, self.now_ns
        for name in dict.fromkeys([*state.cast.drones, *state.vehicles]):
            yield Text(name), *_vehicle(state, name, now_ns), *_belief(state, name, now_ns)
        for name in state.cast.targets:
            yield (
                *(Text(name, style="bold"), Text(), Text("target"), Text(), Text()),
                *_belief(state, name, now_ns),
            )


def _searches(state: MonitorState) -> Iterator[Text]:
    for search in state.estimate.message.searches if state.estimate else ():
        style = "bold red" if search.mode == "LOST" else "yellow"
        yield Text(f"{search.target} {search.mode}: {search.text}", style=style)


def _unseen(state: MonitorState, now_ns: int) -> Iterator[Text]:
    """Yield the expected place of each unseen target, until it is searched for or an alarm names it."""
    searched = {search.target for search in state.estimate.message.searches} if state.estimate else set()
    for name in state.cast.targets:
        target = state.entity(name)
        if target is None or state.estimate is None or name in searched or is_anywhere(target, state.cast.room_m):
            continue
        age_s = target.age_s + state.estimate.age_s(now_ns)
        if TELL_AFTER_S < age_s <= state.cast.lost_after_s:
            yield Text(unseen_words(name, age_s, target.mean[:2]), style="yellow")


def _vehicle(state: MonitorState, name: str, now_ns: int) -> tuple[Text, Text, Text, Text]:
    seen = state.vehicles.get(name)
    if seen is None:
        return Text("no word yet", style="dim"), Text(), Text(), Text()
    status, stale = seen.message, seen.age_s(now_ns) > 1.0
    battery = (
        Text("?", style="dim") if status.battery is None else Text(f"{status.battery:.0%}", style=_battery(state, name))
    )
    dim = "dim" if stale else ""
    return (
        Text(status.mode, style="dim" if stale else _MODE_STYLES.get(status.mode, "")),
        Text(str(status.flight_state).lower(), style=dim),
        battery,
        Text(f"{status.rate_hz:.0f} Hz", style="red" if stale or status.rate_hz < 1 else ""),
    )


def _battery(state: MonitorState, name: str) -> str:
    return {Charge.EMPTY: "bold red", Charge.LOW: "yellow"}.get(battery_of(state, name).charge, "")


def _belief(state: MonitorState, name: str, now_ns: int) -> tuple[Text, Text, Text, Text]:
    entity = state.entity(name)
    sight = _seen_by(state, name, now_ns)
    if entity is None or state.estimate is None:
        return Text(), Text("unknown", style="dim"), Text(), sight
    age = entity.age_s + state.estimate.age_s(now_ns)
    seen_ago = Text(f"{age:.1f} s", style="red" if age > 3 else "yellow" if age > 1 else "")
    if is_anywhere(entity, state.cast.room_m):
        return seen_ago, Text("unknown", style="dim"), Text(), sight
    position = " ".join(f"{value:6.2f}" for value in entity.mean[: 3 if entity.kind == "robot" else 2])
    style = "" if entity.converged else "yellow"
    return (
        seen_ago,
        Text(position, style=style),
        Text("{:.2f} x {:.2f}".format(*ellipse_m(entity)), style=style),
        sight,
    )


def _seen_by(state: MonitorState, name: str, now_ns: int) -> Text:
    observers = sorted(
        observer
        for (observer, subject), stamp_ns in state.sightings.items()
        if subject == name and now_ns - stamp_ns < _SEEN_S * 1e9
    )
    return Text(", ".join(observers) or "nobody", style="" if observers else "dim")


def _plan(state: MonitorState, now_ns: int) -> Text:
    if state.plan is None:
        return Text("no plan yet", style="dim")
    plan = state.plan.message
    stale = state.plan.age_s(now_ns) > 1.0
    text = Text("topology ", style="dim")
    text.append(topology_words(plan.topology), style="dim" if stale else "bold magenta")
    text.append(f"   cost {cost_text(plan.cost)}   planner {plan.solver.seconds * 1000:.0f} ms ({plan.solver.status})")
    others = sorted((a for a in plan.alternatives if a.topology != plan.topology), key=lambda a: a.cost)[:3]
    if others:
        text.append(
            "   instead of " + ", ".join(f"{topology_words(a.topology)} {cost_text(a.cost)}" for a in others),
            style="dim",
        )
    return text


def _cameras(state: MonitorState, now_ns: int) -> Text:
    text = Text("cameras  ", style="dim")
    for name, seen in sorted(state.cameras.items()):
        status = seen.message
        bad = not status.connected or seen.age_s(now_ns) > 2.0
        text.append(f"{name} ", style="red" if bad else "")
        text.append(f"{status.fps:.0f} fps {status.age_ms:.0f} ms   " if status.connected else "no pictures   ")
    return text


def _command(state: MonitorState) -> Text:
    assert state.command is not None
    text = Text("command  ", style="dim")
    text.append(str(state.command.message.verb), style="bold")
    answers = state.answers.get(state.command.message.id, {})
    names = state.command.message.scope or tuple(state.cast.drones)
    for name in (OPERATOR,) if OPERATOR in names else names:  # drones do not answer a request to the operator
        answer = answers.get(name)
        if answer is None:
            text.append(f"  {name} NOT CONFIRMED", style="bold red")
        elif answer.stage is AckStage.REFUSED:
            text.append(f"  {name} refused: {answer.reason}", style="bold red")
        else:
            text.append(
                f"  {name} {str(answer.stage).lower()}", style="green" if answer.stage is AckStage.EFFECTIVE else ""
            )
    return text


def _processes(state: MonitorState, now_ns: int) -> Text:
    text = Text("processes  ", style="dim")
    total = 0.0
    for name, seen in sorted(state.processes.items()):
        status = seen.message
        silent = seen.age_s(now_ns) > 3.0
        total += 0.0 if silent else status.cpu
        text.append(name, style="red" if silent else _STATE_STYLES[status.state])
        text.append(f" {status.cpu:.0%}", style="dim")
        if status.overruns > 0.01 * status.ticks:
            text.append(f" {status.overruns / max(status.ticks, 1):.0%} late", style="yellow")
        text.append("  ")
    text.append(f"together {total:.2f} cores", style="dim")
    return text


def _events(state: MonitorState, now_ns: int) -> list[Text]:
    styles = {Severity.INFO: "", Severity.WARNING: "yellow", Severity.ERROR: "bold red"}
    return [_event(seen, now_ns, styles[seen.message.severity]) for seen in list(state.events)[-_EVENTS:]]


def _event(seen: StampedMessage[Event], now_ns: int, style: str) -> Text:
    event = seen.message
    text = Text(f"{seen.age_s(now_ns):4.0f} s ago  ", style="dim", no_wrap=True, overflow="ellipsis")
    text.append(event.sentence, style=f"not dim {style}".strip())
    if event.remedy:
        text.append(f"  ({event.remedy})", style="dim")
    return text
