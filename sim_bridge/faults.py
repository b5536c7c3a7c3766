"""Faults of a scenario: what breaks when, and what heals."""

from collections.abc import Iterable, Mapping

from sim_bridge.devices.ardrone import ArDroneEmulator
from sim_bridge.devices.mavlink import MavlinkEmulator
from sim_bridge.scenario import CAMERA_FAULTS, Fault, FaultKind
from sim_bridge.world.world import World

Emulator = ArDroneEmulator | MavlinkEmulator


class FaultSchedule:
    """Applies the faults of drones as time passes; those of cameras are handed to the render processes."""

    def __init__(self, faults: Iterable[Fault], world: World, emulators: Mapping[str, Emulator]) -> None:
        self._world, self._emulators = world, emulators
        edges = []
        for fault in faults:
            if fault.kind not in CAMERA_FAULTS:
                edges.append((fault.start_s, True, fault))
                if fault.end_s is not None:
                    edges.append((fault.end_s, False, fault))
        self._edges = sorted(edges, key=lambda edge: edge[0], reverse=True)

    def apply(self, now_s: float) -> list[str]:
        """Break and heal what is due at this time of the world [s]; returns a line for each."""
        lines = []
        while self._edges and self._edges[-1][0] <= now_s:
            _, begins, fault = self._edges.pop()
            self._switch(fault, begins)
            lines.append(f"fault {fault.kind} of {fault.entity} {'begins' if begins else 'ends'}")
        return lines

    def _switch(self, fault: Fault, begins: bool) -> None:
        if fault.kind is FaultKind.NAVDATA_SILENT:
            self._emulators[fault.entity].silent = begins
        elif fault.kind is FaultKind.AT_DEAF:
            self._emulators[fault.entity].deaf = begins
        elif fault.kind is FaultKind.BATTERY_DROP and begins and fault.value is not None:
            self._world.drones[fault.entity].battery = fault.value
        elif fault.kind is FaultKind.PROPELLER_BLOCKED:
            emulator = self._emulators[fault.entity]
            if isinstance(emulator, ArDroneEmulator):
                emulator.control.blocked = begins
