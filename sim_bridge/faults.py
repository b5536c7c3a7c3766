"""Begins and ends a scenario's faults in the world and on links."""

from collections import deque
from collections.abc import Iterable, Mapping, Sequence
from typing import Protocol, runtime_checkable

from sim_bridge.fault_kinds import RULES, Fault, FaultKind, Part
from sim_bridge.world.world import World


class Emulator(Protocol):
    """The switches of an emulated vehicle that faults set."""

    silent: bool
    deaf: bool


@runtime_checkable
class Sufferer(Protocol):
    """A body or an emulator with faults that only its kind can have."""

    def suffer(self, kind: FaultKind, lasting: Sequence[Fault]) -> None:
        """Take all faults of a kind that last now, none: heal; kinds of other parts are ignored."""


class FaultSchedule:
    """Applies faults to the world and to links as time passes, and reports each.

    Wrong values are applied by the vehicles' edges, faults of cameras by the render processes, at the same times.
    """

    def __init__(self, faults: Iterable[Fault], world: World, emulators: Mapping[str, Emulator]) -> None:
        self._world, self._emulators = world, emulators
        edges = []
        for fault in faults:
            edges.append((fault.start_s, True, fault))
            if fault.end_s is not None:
                edges.append((fault.end_s, False, fault))
        self._edges = deque(sorted(edges, key=lambda edge: edge[0]))
        self._standing: list[Fault] = []
        self._flew = False

    def apply(self, now_s: float, flies: bool = False) -> list[tuple[str, str]]:
        """Begin and end the faults that are due at this time of the world [s]; returns (entity, line) for each.

        flies: whether a drone is in the air. With the first one all active faults are reported again, because the
        recording may have begun after it broke.
        """
        lines = []
        if flies and not self._flew:
            self._flew = True
            lines += [(fault.entity, f"fault {described(fault)} lasts") for fault in self._standing]
        while self._edges and self._edges[0][0] <= now_s:
            _, begins, fault = self._edges.popleft()
            (self._standing.append if begins else self._standing.remove)(fault)
            self._switch(fault, begins)
            lines.append((fault.entity, f"fault {described(fault)} {'begins' if begins else 'ends'}"))
        return lines

    def _switch(self, fault: Fault, begins: bool) -> None:
        """Set what a fault breaks by all of its kind that last: the end of one heals none of the others."""
        lasting = [one for one in self._standing if (one.kind, one.entity) == (fault.kind, fault.entity)]
        match fault.kind:
            case FaultKind.NAVDATA_SILENT:
                self._emulators[fault.entity].silent = bool(lasting)
            case FaultKind.AT_DEAF:
                self._emulators[fault.entity].deaf = bool(lasting)
            case FaultKind.BATTERY_DROP if begins:
                self._world.drones[fault.entity].battery = fault.amount
            case FaultKind.WIND:
                self._world.blow(fault.entity, [(one.amount, one.direction_deg) for one in lasting])
            case kind if RULES[kind].part is Part.ABLE_VEHICLE:
                # If ids are swapped, body and emulator are of different vehicles: each takes the faults of its own.
                for one in (self._emulators[fault.entity], self._world.drones[fault.entity]):
                    if isinstance(one, Sufferer):
                        one.suffer(fault.kind, lasting)


def described(fault: Fault) -> str:
    """Return a fault in words: kind, figure, entity."""
    figure = f" {fault.amount:g}" if RULES[fault.kind].value is not None else ""
    other = f", other: {fault.other}" if fault.other else ""
    return f"{fault.kind}{figure} of {fault.entity}{other}"
