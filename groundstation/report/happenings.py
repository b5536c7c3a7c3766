"""Faults of the scenario, reactions of failsafes (rows of their table) and falls that were ordered, by time; pure."""

from collections.abc import Iterator

import msgspec
import numpy as np

from groundstation.bus.messages import AIRBORNE, NOT_DOWN, OPERATOR, STANDING, UP, AckStage, Verb
from groundstation.report.aloft import aloft_at
from groundstation.report.tracks import RunData

_ENDING = frozenset({"LANDING", "CUT"})
_STOPS = frozenset({Verb.LAND, Verb.CUT_MOTORS})
UNEXPLAINED = "unordered"


class Happening(msgspec.Struct, frozen=True):
    """One fault of an entity, or one reaction to it.

    cause: the condition of the table of failsafes, "fault" for one of the scenario, "unordered" for a drone that came
    down without an order and without its driver; text: in words.
    """

    time_s: float
    entity: str
    cause: str
    text: str
    ended_flight: bool = False

    @property
    def line(self) -> str:
        """Return it as it is printed."""
        return f"{self.time_s:.1f} s  {self.entity}: {self.text}"


def happenings(data: RunData) -> list[Happening]:
    """Return faults and reactions in order of time."""
    found = [*_faults(data)]
    for drone in data.vehicles:
        found += _reactions(data, drone)
    return sorted(found, key=lambda item: item.time_s)


def landings(found: list[Happening]) -> list[Happening]:
    """Return the first landing of each drone that nobody ordered."""
    first: dict[str, Happening] = {}
    for item in found:
        if item.ended_flight:
            first.setdefault(item.entity, item)
    return list(first.values())


def cuts_in_flight(data: RunData) -> list[Happening]:
    """Return the first order to each flying drone to cut its motors: it falls, whoever gave the order.

    Flying: by its own last report. Cuts by a failsafe are among the landings.
    """
    first: dict[str, Happening] = {}
    for item in data.commands:
        order = item.message
        if order.verb is not Verb.CUT_MOTORS or OPERATOR in order.scope:
            continue
        for drone in order.scope or data.vehicles:
            flew = aloft_at(data.vehicles.get(drone, ()), np.array([item.time_s]))[0]
            if flew and not _refused(data, drone, order.id):
                text = f"motors cut in the air by {order.issuer}"
                first.setdefault(drone, Happening(item.time_s, drone, "cut", text, ended_flight=True))
    return list(first.values())


def _refused(data: RunData, drone: str, command_id: str) -> bool:
    """Return whether a drone's driver refused a command."""
    said = (ack.message for ack in data.acks if ack.message.command_id == command_id)
    return any(one.header.entity == drone and one.stage is AckStage.REFUSED for one in said)


def _faults(data: RunData) -> Iterator[Happening]:
    begun: set[str] = set()
    for event in data.events:
        text, entity = event.message.text, event.message.header.entity
        if not event.message.injected:
            continue
        if text.endswith(" lasts"):
            text = f"{text.removesuffix(' lasts')} begins"
            if text in begun:
                continue
            text += ", or did before"
        begun.add(text)
        yield Happening(event.time_s, entity, "fault", text)


def _reactions(data: RunData, drone: str) -> Iterator[Happening]:
    """Yield each entry into a mode by a failsafe, and each unexplained end of a flight."""
    before, left_s, up, explained = "", None, False, False
    told = set[str]()
    for item in sorted(data.vehicles[drone], key=lambda item: item.time_s):
        status = item.message
        if status.mode != before or not status.failsafe:
            before, told = status.mode, set()
        if status.failsafe and status.failsafe not in told:
            told.add(status.failsafe)
            ends = status.mode in _ENDING and status.failsafe not in NOT_DOWN
            explained = explained or ends
            text = f"{status.mode} by failsafe {status.failsafe}: {status.detail}"
            yield Happening(item.time_s, drone, status.failsafe, text, ends)
        if status.flight_state in AIRBORNE and left_s is None:
            left_s = item.time_s
        if status.flight_state in UP and not up:
            up, explained = True, False
        elif status.flight_state in STANDING and left_s is not None:
            if up and not explained and not _ordered(data, drone, left_s, item.time_s):
                text = "came down without an order and without its driver"
                yield Happening(item.time_s, drone, UNEXPLAINED, text, True)
            left_s, up = None, False


def _ordered(data: RunData, drone: str, start_s: float, end_s: float) -> bool:
    """Return whether somebody ordered a drone down in a span of time."""
    return any(
        command.message.verb in _STOPS
        and start_s <= command.time_s <= end_s
        and drone in (command.message.scope or (drone,))
        for command in data.commands
    )
