"""The console's state and its sections for the page; the newest of everything is shared with the monitor."""

from collections.abc import Iterable, Mapping
from dataclasses import asdict
from types import MappingProxyType
from typing import Any, TypeVar

import msgspec

from groundstation.bus import messages as m
from groundstation.bus.api import Received
from groundstation.console import told
from groundstation.console.alarm_log import AlarmLog
from groundstation.console.history import History
from groundstation.console.innovation_statistics import InnovationStatistics
from groundstation.console.snapshot import Snapshot
from groundstation.console.standing import StandingDrones
from groundstation.field.room import WorldCamera
from groundstation.monitor.alarms import alarms_of
from groundstation.monitor.batteries import battery_of
from groundstation.monitor.endurance import flies, may_fly
from groundstation.monitor.safety import safety_of
from groundstation.monitor.state import Cast, MonitorState, StampedMessage, heard_ns
from groundstation.monitor.whereabouts import is_anywhere
from groundstation.sensing.switches import Switch, switch_between

_EVENTS = 40
# Sections that change slowly are looked at every so many turns.
_OFTEN, _SELDOM = 2, 5
# Trails and curves continue only with data no older than this: a line that runs on would look measured.
_CURRENT_S = 1.0
_T = TypeVar("_T")
NO_CAMERAS: Mapping[str, WorldCamera] = MappingProxyType({})


class ConsoleState:
    """Takes messages in and puts the sections of the board; pure but for the objects passed to it."""

    def __init__(self, cast: Cast, started_ns: int, cameras: Mapping[str, WorldCamera] = NO_CAMERAS) -> None:
        self.standing = StandingDrones(cameras, cast.drones)
        self.monitor = MonitorState(cast=cast, started_ns=started_ns)
        self.health = InnovationStatistics()
        self.history = History(cast.targets)
        self.alarm_log = AlarmLog()
        self.switch: Switch | None = None
        self.setpoints: dict[str, StampedMessage[m.VelocitySetpoint]] = {}
        self.truth: dict[str, StampedMessage[m.TruthState]] = {}
        self.search_maps: dict[str, m.SearchMap] = {}
        self._airborne_since_ns: int | None = None
        self._stood: set[str] = set()
        self._or_longer = False
        self._flown = False

    def ingest(self, received: Iterable[Received]) -> None:
        """Remember messages."""
        for item in received:
            match item.message:
                case m.VelocitySetpoint() as setpoint:
                    self.setpoints[item.header.entity] = StampedMessage(heard_ns(item), setpoint)
                case m.TruthState() as truth:
                    self.truth[item.header.entity] = StampedMessage(heard_ns(item), truth)
                case m.SearchMap() as search_map:
                    self.search_maps[item.header.entity] = search_map
                case m.Innovation() as innovation:
                    self.health.take(innovation)
                case m.RelativeObservation() as sighting:
                    self.standing.see(sighting)
                    self.monitor.ingest((item,))
                case m.Plan() as plan:
                    before = self.monitor.plan.message if self.monitor.plan else plan
                    self.switch = switch_between(before, plan, heard_ns(item) / 1e9) or self.switch
                    self.monitor.ingest((item,))
                case _:
                    self.monitor.ingest((item,))

    def note(self, now_ns: int) -> None:
        """Extend trails and curves when due."""
        if not self.history.due(now_ns):
            return
        truth = {name: seen.message for name, seen in self.truth.items()}
        estimate, plan = _current(self.monitor.estimate, now_ns), _current(self.monitor.plan, now_ns)
        if estimate is not None:
            room_m = self.monitor.cast.room_m
            placed = tuple(entity for entity in estimate.entities if not is_anywhere(entity, room_m))
            estimate = msgspec.structs.replace(estimate, entities=placed)
        nis = self.health.nis() if estimate is not None and self.history.sample_due(now_ns) else None
        self.history.step(now_ns, estimate, plan, nis, truth)

    def doing(self) -> dict[str, str]:
        """Return each drone's reported action."""
        return {name: seen.message.detail or seen.message.mode for name, seen in self.monitor.vehicles.items()}

    def put(self, board: Snapshot, now_ns: int) -> None:
        """Put the changed values on the board."""
        board.put("estimate", told.estimate(self.monitor.estimate, self.monitor.cast.room_m))
        board.put("setpoints", {name: told.setpoint(seen) for name, seen in self.setpoints.items()})
        if self.truth:
            board.put("truth", {name: told.truth(seen) for name, seen in self.truth.items()})
        points, samples = self.history.take_new()
        board.add("points", points)
        board.add("samples", samples)
        if board.turn % _OFTEN == 0:
            self.put_often(board, now_ns)
        if board.turn % _SELDOM == 0:
            self.put_seldom(board, now_ns)

    def put_often(self, board: Snapshot, now_ns: int) -> None:
        """Put the values that change ten times a second."""
        known = self.monitor
        vehicles = known.vehicles.items()
        board.put(
            "vehicles", {name: told.vehicle(seen) | told.battery(battery_of(known, name)) for name, seen in vehicles}
        )
        board.put("flight", self._flight())
        board.put("plan", told.plan(known.plan))
        board.put("switch", told.switch(self.switch))
        board.put("sightings", [[*edge, stamp_ns / 1e6] for edge, stamp_ns in known.sightings.items()])
        board.put("events", [told.event(seen) for seen in list(known.events)[-_EVENTS:]])
        # As often as the values computed by the page: an ended alarm must not be shown beside newer ones.
        alarms = alarms_of(known, now_ns)
        self.alarm_log.note(alarms, now_ns)
        board.put("alarms", [told.alarm(alarm) for alarm in alarms])
        board.put("safety", asdict(safety_of(known, alarms)))

    def _flight(self) -> dict[str, Any]:
        """Return since when a drone is in the air, whether longer for all that is known, and whether any ever was."""
        seen, take_offs = self.monitor.vehicles.items(), self.monitor.take_offs
        airborne = {name: status.stamp_ns for name, status in seen if flies(status.message, take_offs.get(name))}
        self._flown |= bool(airborne)
        self._airborne_since_ns = (self._airborne_since_ns or min(airborne.values())) if airborne else None
        self._stood |= {name for name, status in seen if not may_fly(status.message, take_offs.get(name))}
        # Whose take-off this console was not there to see, was up before.
        unseen = not airborne.keys() <= self._stood
        self._or_longer = bool(airborne) and (self._or_longer or unseen)
        since_ns = self._airborne_since_ns
        return {
            "airborne_since_ms": None if since_ns is None else since_ns / 1e6,
            "or_longer": self._or_longer,
            "flown": self._flown,
        }

    def _standing(self, now_ns: int) -> list[dict[str, Any]]:
        estimate = self.monitor.estimate.message.entities if self.monitor.estimate else ()
        states = {name: seen.message.flight_state for name, seen in self.monitor.vehicles.items()}
        found = self.standing.now(now_ns, states, {entity.name for entity in estimate})
        return [
            {
                "name": one.name,
                "place": told.rounded(one.place_m, 2),
                "yaw": None if one.yaw_rad is None else round(one.yaw_rad, 2),
            }
            for one in found
        ]

    def _search_maps(self) -> dict[str, dict[str, Any]]:
        """Return the map of each target that is searched for now."""
        seen = self.monitor.estimate
        wanted = {search.target for search in seen.message.searches} if seen else set()
        return {name: told.search_map(one) for name, one in self.search_maps.items() if name in wanted}

    def put_seldom(self, board: Snapshot, now_ns: int) -> None:
        """Put the sections that may be a quarter of a second old."""
        known = self.monitor
        board.put("cameras", {name: told.camera(seen) for name, seen in known.cameras.items()})
        board.put("processes", {name: told.process(seen) for name, seen in known.processes.items()})
        board.put("standing", self._standing(now_ns))
        board.put("search_maps", self._search_maps())
        board.put("past_alarms", self.alarm_log.as_json())
        board.put("health", self.health.summary())
        if (checks := self.monitor.preflight) is not None:
            board.put("preflight", {"at": told.milliseconds(checks), "findings": checks.message.findings})


def _current(seen: StampedMessage[_T] | None, now_ns: int) -> _T | None:
    return seen.message if seen is not None and seen.age_s(now_ns) < _CURRENT_S else None
