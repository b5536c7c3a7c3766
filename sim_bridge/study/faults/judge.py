"""Judges a flight with faults, by truth alone."""

import math
from collections.abc import Collection, Iterable, Mapping
from itertools import combinations
from typing import Any

import numpy as np

from groundstation.arrays import Array
from groundstation.sensing.models import Box
from sim_bridge.fault_kinds import Fault, FaultKind
from sim_bridge.study.faults.deafness import DeafSpells
from sim_bridge.study.faults.stops import HOVER_S, REST_S, WATCHED_S, Flown, Stop, stop_of

SEPARATION_M, OBSTACLE_M = 0.6, 0.3
FASTER_M_S = 0.3  # above the drone's limit: a gust, or a correction, may add this
# No field lets a drone sink faster than 1.5 m/s; one that falls by 0.3 m is faster than this.
FELL_M_S = 2.0
LOST_M, LOST_S = 0.5, 1.0
# After these faults the drone must stop: its reports cannot steer it.
MUST_STOP = frozenset(
    {
        FaultKind.NAVDATA_SILENT,
        FaultKind.TELEMETRY_FROZEN,
        FaultKind.VELOCITY_STUCK,
        FaultKind.UNIFORM_FLOOR,
    }
)


class Judge:
    """Call `see` at an even rate from the first lift-off on; `verdict` returns the figures.

    root: the world-fixed camera, if there is only one: when its picture freezes, all drones must stop.
    """

    def __init__(
        self, room: Mapping[str, Any], limits_m_s: Mapping[str, float], period_s: float, root: str | None = None
    ) -> None:
        fence = room["fence"]
        self._fence = np.array([fence["x_m"], fence["y_m"], fence["z_m"]])
        self._boxes = [Box(one["centre_m"], one["size_m"]) for one in room.get("obstacles", {}).values()]
        self._limits, self._period_s, self._root = limits_m_s, period_s, root
        self._flown = {name: Flown() for name in limits_m_s}
        self._lost_s = dict.fromkeys(limits_m_s, 0.0)
        self.separation_m, self.fence_m, self.speed_m_s, self.lost_s = math.inf, 0.0, 0.0, 0.0
        self.obstacle_m = math.inf
        self.sinking_m_s = dict.fromkeys(limits_m_s, 0.0)
        self.first: dict[str, float] = {}
        self._deafness = DeafSpells()
        # Bounds that were first broken by drones that received no command.
        self._unreached: set[str] = set()

    def see(
        self,
        now_s: float,
        truth: Mapping[str, Array],
        told: Mapping[str, bool],
        believed: Mapping[str, Array | None],
        deaf: Collection[str] = (),
    ) -> None:
        """Record one moment.

        truth: rows of the truth board; told: drones that get a velocity; believed: estimated x, y of each; deaf: those
        that receive nothing.
        """
        aloft = {name: row for name, row in truth.items() if name in self._flown and not row[12]}
        self._deafness.see(now_s, aloft, deaf)
        for a, b in combinations(aloft, 2):
            self._worst(now_s, "separation", float(np.linalg.norm(aloft[a][:3] - aloft[b][:3])), by=(a, b))
        for name, flown in self._flown.items():
            row = truth[name]
            flown.see(now_s, row, told[name])
            if name in aloft:
                self._see_one(now_s, name, row, told[name], believed[name])

    def _see_one(self, now_s: float, name: str, row: Array, told: bool, believed: Array | None) -> None:
        outside = np.maximum(self._fence[:, 0] - row[:3], row[:3] - self._fence[:, 1])
        self._worst(now_s, "fence", float(outside.max()), by=(name,))
        for box in self._boxes:
            self._worst(now_s, "obstacle", float(box.distances_m(row[None, :3])[0]), by=(name,))
        self._worst(now_s, "speed", math.hypot(row[3], row[4]), self._limits[name] + FASTER_M_S, by=(name,))
        self.sinking_m_s[name] = max(self.sinking_m_s[name], -float(row[5]))
        self._worst(now_s, "fell", -float(row[5]), FELL_M_S, by=(name,))
        off_m = math.inf if believed is None else float(np.hypot(*(believed - row[:2])))
        self._lost_s[name] = self._lost_s[name] + self._period_s if told and off_m > LOST_M else 0.0
        self._worst(now_s, "unlocalised", self._lost_s[name])

    def _worst(self, now_s: float, what: str, figure: float, limit: float = 0.0, by: tuple[str, ...] = ()) -> None:
        match what:
            case "separation":
                self.separation_m, bad = min(self.separation_m, figure), figure < SEPARATION_M
            case "fence":
                self.fence_m, bad = max(self.fence_m, figure), figure > 0.0
            case "obstacle":
                self.obstacle_m, bad = min(self.obstacle_m, figure), figure < OBSTACLE_M
            case "speed":
                self.speed_m_s, bad = max(self.speed_m_s, figure), figure > limit
            case "fell":
                bad = figure > limit
            case _:
                self.lost_s, bad = max(self.lost_s, figure), figure > LOST_S
        if bad and what not in self.first:
            self.first[what] = round(now_s, 2)
            if by and all(name in self._deafness.out_of_reach for name in by):
                self._unreached.add(what)

    def verdict(self, faults: tuple[Fault, ...], observable_s: tuple[float | None, ...]) -> dict[str, Any]:
        """Return the figures; unsafe: the violated bounds, with their times [s].

        unreached: of these, those by a drone that received nothing, while nothing else had gone wrong yet: the ground
        could not stop it. If two drones came together, both must have received nothing: one could have given way.
        """
        stops: list[Stop] = []
        for fault, shown_s in zip(faults, observable_s, strict=True):
            until_s = math.inf if fault.end_s is None else fault.end_s
            for flown, since_s in self._due(fault, shown_s):
                stops.append(stop := stop_of(flown, since_s, until_s))
                self._judge_stop(stop, since_s)
        return {
            "separation_m": round(self.separation_m, 3) if math.isfinite(self.separation_m) else None,
            "fence_m": round(max(0.0, self.fence_m), 3),
            "obstacle_m": round(self.obstacle_m, 3) if self._boxes else None,
            "speed_m_s": round(self.speed_m_s, 3),
            "unlocalised_s": round(self.lost_s, 2),
            "hover_s": round(max(stop.hover_s for stop in stops), 2) if stops else None,
            "rest_s": round(max(stop.rest_s for stop in stops), 2) if stops else None,
            "unsafe": dict(sorted(self.first.items(), key=lambda item: item[1])),
            "unreached": sorted(what for what in self._unreached if self._only_deaf(faults, self.first[what])),
            "deaf": self._deafness.rows(),
        }

    def _only_deaf(self, faults: Iterable[Fault], until_s: float) -> bool:
        return all(fault.kind is FaultKind.AT_DEAF for fault in faults if fault.start_s <= until_s)

    def _judge_stop(self, stop: Stop, since_s: float) -> None:
        late = {"hover": stop.hover_s > HOVER_S, "rest": stop.rest_s > REST_S}
        broken = {what: since_s for what, is_late in late.items() if is_late}
        if stop.resumed_s is not None:
            broken["resumed"] = stop.resumed_s
        for what, at_s in broken.items():
            self.first[what] = min(self.first.get(what, math.inf), round(at_s, 2))

    def stop_judged(self, fault: Fault, shown_s: float | None) -> bool | None:
        """Return whether the stop that a fault demands was judged; None where nobody had to stop for it.

        Not judged: it never showed, or healed or was flown for too short a time after it did.
        """
        return any(True for _ in self._due(fault, shown_s)) if self._stopped_by(fault) else None

    def _due(self, fault: Fault, shown_s: float | None) -> Iterable[tuple[Flown, float]]:
        """Return the drones that had to stop and from when on [s], if the fault lasted that long."""
        if shown_s is None:
            return
        for flown in map(self._flown.__getitem__, self._stopped_by(fault)):
            if not flown.times:
                continue
            since_s = max(shown_s, flown.times[0])
            lasts = fault.end_s is None or fault.end_s - since_s >= REST_S
            if lasts and flown.times[-1] - since_s >= WATCHED_S:
                yield flown, since_s

    def _stopped_by(self, fault: Fault) -> Collection[str]:
        if fault.kind is FaultKind.PICTURE_FROZEN:
            return self._flown if fault.entity == self._root else ()
        return (fault.entity,) if fault.kind in MUST_STOP and fault.entity in self._flown else ()
