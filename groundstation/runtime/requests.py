"""Requests of other shells: each is obeyed once, never after a later stop, and answered as often as it is repeated."""

from collections.abc import Collection
from typing import Any

from groundstation.bus import clock
from groundstation.bus.api import Bus
from groundstation.bus.messages import OPERATOR, AckStage, Command, CommandAck
from groundstation.bus.stop_mark import StopMark, why_too_old
from groundstation.bus.topics import COMMAND_ACK
from groundstation.time_units import NS_PER_S

_REMEMBERED = 256


def asks_for_start(message: object) -> bool:
    """Return whether this is a request to the operator to start something."""
    return isinstance(message, Command) and OPERATOR in message.scope and not message.verb.stops


def named(command: Command) -> tuple[str, ...]:
    """Return the drones that a command names, once each; none: all are meant."""
    return tuple(name for name in dict.fromkeys(command.scope) if name != OPERATOR)


def asked_ns(start: Command | None) -> int | None:
    """Return when a start was requested [ns; our boot clock]; None for other commands.

    Drivers need it to refuse a start that is older than a stop that they received.
    """
    return None if start is None or start.verb.stops else start.header.stamp_ns


class Requests:
    """Remembers the last answer to each request, the stops that arrived, and the last stop of each drone."""

    def __init__(self, bus: Bus, drones: Collection[str]) -> None:
        self._bus = bus
        self._drones = drones
        self._answers: dict[str, tuple[AckStage, str]] = {}
        self._stops: dict[str, StopMark] = {}
        self._heard: dict[str, None] = {}

    def answer_again(self, request: Command) -> bool:
        """Repeat the answer to a request that was answered before; returns whether it was."""
        known = self._answers.get(request.id)
        if known is not None:
            self._publish(request, *known)
        return known is not None

    def answer(self, request: Command, stage: AckStage, reason: str = "") -> None:
        """Answer a request."""
        _make_room(self._answers)
        self._answers[request.id] = stage, reason
        self._publish(request, stage, reason)

    def _publish(self, request: Command, stage: AckStage, reason: str) -> None:
        header = self._bus.header(OPERATOR)
        ack = CommandAck(header=header, command_id=request.id, verb=request.verb, stage=stage, reason=reason)
        self._bus.publish(COMMAND_ACK, ack)

    def hear_stop(self, now_ns: int, stop: Command) -> bool:
        """Remember a stop of the drones that it names, or of all; returns whether it is new."""
        if stop.id in self._heard:
            return False
        _make_room(self._heard)
        self._heard[stop.id] = None
        mark = StopMark.of(stop, now_ns, clock.clock_id())
        for name in named(stop) or self._drones:
            if name not in self._stops or self._stops[name].given_ns < mark.given_ns:
                self._stops[name] = mark
        return True

    def refusal(self, now_ns: int, request: Command) -> str:
        """Return why a request is refused, or "".

        A shell that misses an answer repeats its request for up to a minute. It must not undo a stop that came
        meanwhile, so a start whose time is unknown is refused (`asking.by_clock_of`).
        """
        names = named(request)
        strangers = [name for name in names if name not in self._drones]
        if request.run != self._bus.run:
            return f"given for another run ({request.run})"
        if strangers:
            return f"there is no drone {', '.join(strangers)}"
        if request.verb.stops:
            return why_too_old(request, now_ns, clock.clock_id())
        if request.header.clock != clock.clock_id():
            return "nobody knows here when it was given: install this version on the host that it was given on, too"
        if 0 < request.expires_ns <= now_ns:
            return f"given {(now_ns - request.header.stamp_ns) / NS_PER_S:.0f} s ago"
        return self.overtaken(request.header.stamp_ns, names)

    def overtaken(self, given_ns: int, names: Collection[str] = ()) -> str:
        """Return the stop that came after a start of some drones (none named: of all) was given, or ""."""
        later = [self._stops[name] for name in names or self._drones if name in self._stops]
        return next((stop.words for stop in later if stop.overtakes(given_ns)), "")


def _make_room(memory: dict[str, Any]) -> None:
    if len(memory) >= _REMEMBERED:
        del memory[next(iter(memory))]
