"""Draws the state on a terminal; without a terminal, prints a line now and then."""

import sys
from contextlib import ExitStack, suppress
from types import TracebackType
from typing import Self

from rich.console import Console
from rich.live import Live

from groundstation.appearance.plain_text import one_line
from groundstation.appearance.topology import topology_words
from groundstation.bus.api import Bus, Subscription
from groundstation.bus.topics import (
    CAMERA_STATUS,
    COMMAND,
    COMMAND_ACK,
    ESTIMATE,
    EVENT,
    LEASE,
    OBSERVATION,
    PLAN,
    PREFLIGHT,
    PROCESS_STATUS,
    SIM_STATUS,
    SUSPICION,
    VEHICLE_STATUS,
)
from groundstation.monitor.alarms import alarms_of
from groundstation.monitor.state import Cast, MonitorState
from groundstation.monitor.table import render
from groundstation.process.standard_streams import with_sequences
from groundstation.time_units import NEVER_NS, NS_PER_MS, NS_PER_S

DRAW_PERIOD_NS = 250 * NS_PER_MS
_LINE_PERIOD_NS = 5 * NS_PER_S


class Screen:
    """Context manager around the terminal. Call `turn` often: it draws four times a second."""

    def __init__(self, bus: Bus, cast: Cast, now_ns: int, console: Console | None = None, hint: str = "") -> None:
        self.state = MonitorState(cast=cast, hint=hint, started_ns=now_ns)
        self._console = console or Console(file=with_sequences(sys.stdout))
        self._newest = bus.subscribe(
            (ESTIMATE, PLAN, VEHICLE_STATUS, CAMERA_STATUS, PROCESS_STATUS, LEASE, SIM_STATUS, SUSPICION, PREFLIGHT),
            newest=True,
        )
        # Of these every message counts, not only the newest of a key.
        self._each: Subscription = bus.subscribe((EVENT, COMMAND, COMMAND_ACK, OBSERVATION), capacity=1024)
        self._due_ns = 0
        self._live: Live | None = None
        self._stack = ExitStack()

    def __enter__(self) -> Self:
        if self._console.is_terminal and not self._console.is_dumb_terminal:  # Live draws nothing on a dumb terminal
            live = Live(
                console=self._console, screen=True, auto_refresh=False, redirect_stdout=False, redirect_stderr=False
            )
            self._live = self._stack.enter_context(live)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        with suppress(OSError):
            self._stack.close()  # restores the terminal's former content

    def listen(self) -> None:
        """Take in messages without drawing."""
        self.state.ingest(self._newest.drain())
        self.state.ingest(self._each.drain())

    def turn(self, now_ns: int) -> None:
        """Take in messages, and draw if it is time."""
        if now_ns < self._due_ns:
            return
        self.listen()
        try:
            self._draw(now_ns)
        except OSError:
            self._due_ns = NEVER_NS  # the terminal is gone; the run is not

    def _draw(self, now_ns: int) -> None:
        if self._live is not None:
            self._due_ns = now_ns + DRAW_PERIOD_NS
            self._live.update(render(self.state, now_ns), refresh=True)
        else:
            self._due_ns = now_ns + _LINE_PERIOD_NS
            self._console.print(line(self.state, now_ns), markup=False, highlight=False, soft_wrap=True)


def line(state: MonitorState, now_ns: int) -> str:
    """Return the state in one line, for logs and pipes."""
    vehicles = [f"{name} {seen.message.mode}" for name, seen in state.vehicles.items()]
    plan = [f"topology {topology_words(state.plan.message.topology)}"] if state.plan else []
    alarms = [f"! {alarm.text}" for alarm in alarms_of(state, now_ns)]
    seconds = (now_ns - state.started_ns) / 1e9
    return f"{seconds:5.0f} s  " + one_line("; ".join([*vehicles, *plan, *alarms]))
