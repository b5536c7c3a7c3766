"""What the console knows, and how it is said to the page; the newest of everything is shared with the monitor."""

from collections.abc import Iterable, Mapping
from dataclasses import asdict
from types import MappingProxyType
from typing import Any, TypeVar

from groundstation.appearance.cost import cost_cm2, cost_text
from groundstation.appearance.topology import topology_words
from groundstation.bus import messages as m
from groundstation.bus.api import Received
from groundstation.console.alarm_log import AlarmLog
from groundstation.console.history import History
from groundstation.console.innovation_statistics import InnovationStatistics
from groundstation.console.snapshot import Snapshot
from groundstation.console.standing import StandingDrones
from groundstation.field.room import WorldCamera
from groundstation.monitor.alarms import Alarm, alarms_of
from groundstation.monitor.batteries import Battery, battery_of
from groundstation.monitor.endurance import flies
from groundstation.monitor.safety import safety_of
from groundstation.monitor.state import Cast, MonitorState, StampedMessage
from groundstation.sensing.switches import Switch, switch_between

_EVENTS = 40
_ALTERNATIVES = 8
# Sections that change slowly are looked at every so many turns.
_OFTEN, _SELDOM = 2, 5
# What trails and curves go on with is no older: a line that runs on would look as if it were measured.
_CURRENT_S = 1.0
_T = TypeVar("_T")
NO_CAMERAS: Mapping[str, WorldCamera] = MappingProxyType({})


class ConsoleState:
    """Takes messages in and puts the sections of the board; pure but for what it is given."""

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
        self.preflight: StampedMessage[m.Preflight] | None = None
        self._sample: dict[str, Any] | None = None
        self._airborne_since_ns: int | None = None
        self._flown = False

    def ingest(self, received: Iterable[Received]) -> None:
        """Remember messages."""
        for item in received:
            match item.message:
                case m.VelocitySetpoint() as setpoint:
                    self.setpoints[item.header.entity] = StampedMessage(item.header.stamp_ns, setpoint)
                case m.TruthState() as truth:
                    self.truth[item.header.entity] = StampedMessage(item.header.stamp_ns, truth)
                case m.SearchMap() as search_map:
                    self.search_maps[item.header.entity] = search_map
                case m.Preflight() as preflight:
                    self.preflight = StampedMessage(item.header.stamp_ns, preflight)
                case m.Innovation() as innovation:
                    self.health.take(innovation)
                case m.RelativeObservation() as sighting:
                    self.standing.see(sighting)
                    self.monitor.ingest((item,))
                case m.Plan() as plan:
                    before = self.monitor.plan.message if self.monitor.plan else plan
                    self.switch = switch_between(before, plan, item.header.stamp_ns / 1e9) or self.switch
                    self.monitor.ingest((item,))
                case _:
                    self.monitor.ingest((item,))

    def note(self, now_ns: int) -> None:
        """Let trails and curves go on, where it is time for it."""
        if not self.history.due(now_ns):
            return
        truth = {name: seen.message for name, seen in self.truth.items()}
        estimate, plan = _current(self.monitor.estimate, now_ns), _current(self.monitor.plan, now_ns)
        nis = self.health.nis() if estimate is not None and self.history.sample_due(now_ns) else None
        self._sample = self.history.step(now_ns, estimate, plan, nis, truth) or self._sample

    def put(self, board: Snapshot, now_ns: int) -> None:
        """Put what changed on the board."""
        board.put("estimate", _estimate(self.monitor.estimate))
        board.put("setpoints", {name: _setpoint(seen) for name, seen in self.setpoints.items()})
        if self.truth:
            board.put("truth", {name: _truth(seen) for name, seen in self.truth.items()})
        if self._sample is not None:
            board.put("sample", self._sample)
        if board.turn % _OFTEN == 0:
            self.put_often(board)
        if board.turn % _SELDOM == 0:
            self.put_seldom(board, now_ns)

    def put_often(self, board: Snapshot) -> None:
        """Put what changes ten times a second."""
        known = self.monitor
        vehicles = known.vehicles.items()
        board.put("vehicles", {name: _vehicle(seen) | _battery(battery_of(known, name)) for name, seen in vehicles})
        board.put("flight", self._flight())
        board.put("plan", _plan(known.plan))
        board.put("switch", _switch(self.switch))
        board.put("sightings", [[*edge, stamp_ns / 1e6] for edge, stamp_ns in known.sightings.items()])
        board.put("events", [_event(seen) for seen in list(known.events)[-_EVENTS:]])

    def _flight(self) -> dict[str, Any]:
        """Return since when somebody is in the air, and whether anybody ever was."""
        seen, take_offs = self.monitor.vehicles.items(), self.monitor.take_offs
        airborne = [status.stamp_ns for name, status in seen if flies(status.message, take_offs.get(name))]
        self._flown |= bool(airborne)
        self._airborne_since_ns = (self._airborne_since_ns or min(airborne)) if airborne else None
        since_ns = self._airborne_since_ns
        return {"airborne_since_ms": None if since_ns is None else since_ns / 1e6, "flown": self._flown}

    def _standing(self, now_ns: int) -> list[dict[str, Any]]:
        estimate = self.monitor.estimate.message.entities if self.monitor.estimate else ()
        states = {name: seen.message.flight_state for name, seen in self.monitor.vehicles.items()}
        found = self.standing.now(now_ns, states, {entity.name for entity in estimate})
        return [
            {
                "name": one.name,
                "place": _rounded(one.place_m, 2),
                "yaw": None if one.yaw_rad is None else round(one.yaw_rad, 2),
            }
            for one in found
        ]

    def _search_maps(self) -> dict[str, dict[str, Any]]:
        """Return where each target may be that is searched for now."""
        seen = self.monitor.estimate
        wanted = {search.target for search in seen.message.searches} if seen else set()
        return {name: _search_map(one) for name, one in self.search_maps.items() if name in wanted}

    def put_seldom(self, board: Snapshot, now_ns: int) -> None:
        """Put what may be a quarter of a second old."""
        known = self.monitor
        board.put("cameras", {name: _camera(seen) for name, seen in known.cameras.items()})
        board.put("processes", {name: _process(seen) for name, seen in known.processes.items()})
        board.put("standing", self._standing(now_ns))
        board.put("search_maps", self._search_maps())
        alarms = alarms_of(known, now_ns)
        self.alarm_log.note(alarms, now_ns)
        board.put("alarms", [_alarm(alarm) for alarm in alarms])
        board.put("safety", asdict(safety_of(known, alarms)))
        board.put("past_alarms", self.alarm_log.as_json())
        board.put("health", self.health.summary())
        if self.preflight is not None:
            board.put("preflight", {"at": _ms(self.preflight), "findings": self.preflight.message.findings})


def _alarm(alarm: Alarm) -> dict[str, Any]:
    values = asdict(alarm)
    told_ns = values.pop("told_ns")
    return {**values, "asks": alarm.asks, "told": None if told_ns is None else told_ns / 1e6}


def _current(seen: StampedMessage[_T] | None, now_ns: int) -> _T | None:
    return seen.message if seen is not None and seen.age_s(now_ns) < _CURRENT_S else None


def _ms(seen: StampedMessage[Any]) -> float:
    return seen.stamp_ns / 1e6


def _rounded(values: Iterable[float], digits: int = 4) -> list[float]:
    return [round(value, digits) for value in values]


def _estimate(seen: StampedMessage[m.Estimate] | None) -> dict[str, Any] | None:
    if seen is None:
        return None
    entities = [
        {
            "name": entity.name,
            "kind": entity.kind,
            "mean": _rounded(entity.mean),
            # Horizontal part only: xx, xy, yy [m^2].
            "cov": _rounded((entity.covariance[0], entity.covariance[1], entity.covariance[len(entity.mean) + 1]), 7),
            "velocity": _rounded(entity.velocity_m_s, 3),
            "converged": entity.converged,
            # Never seen is infinite in the filter, which JSON cannot say.
            "age_s": round(min(entity.age_s, 1e6), 2),
        }
        for entity in seen.message.entities
    ]
    searches = {search.target: [search.mode, search.text] for search in seen.message.searches}
    return {"at": _ms(seen), "epoch": seen.message.epoch, "entities": entities, "searches": searches}


def _search_map(seen: m.SearchMap) -> dict[str, Any]:
    return {"first": seen.first_m, "cell": seen.cell_m, "columns": seen.columns, "chances": seen.chances}


def _setpoint(seen: StampedMessage[m.VelocitySetpoint]) -> dict[str, Any]:
    setpoint = seen.message
    return {
        "at": _ms(seen),
        "velocity": _rounded(setpoint.velocity_m_s, 3),
        "yaw_rate": round(setpoint.yaw_rate_rad_s, 3),
        "converged": setpoint.converged,
    }


def _truth(seen: StampedMessage[m.TruthState]) -> dict[str, Any]:
    truth = seen.message
    return {"at": _ms(seen), "position": _rounded(truth.position_m, 3), "yaw": round(truth.attitude_rad[2], 4)}


def _vehicle(seen: StampedMessage[m.VehicleStatus]) -> dict[str, Any]:
    status = seen.message
    return {
        "at": _ms(seen),
        "mode": status.mode,
        "flight": status.flight_state,
        "link": status.link_quality,
        "rate_hz": round(status.rate_hz, 1),
        "detail": status.detail,
        "braked": status.braked,
        "lands_in_s": None if status.lands_in_s is None else round(status.lands_in_s, 1),
        "rejected": sum(status.rejected.values()),
    }


def _battery(battery: Battery) -> dict[str, Any]:
    left = battery.endurance
    minutes = None if left is None else round(left.minutes, 1)
    words = "" if left is None else left.words
    return {
        "battery": battery.level,
        "battery_min": battery.limit,
        "charge": battery.charge,
        "minutes": minutes,
        "good_for": words,
    }


def _camera(seen: StampedMessage[m.CameraStatus]) -> dict[str, Any]:
    status = seen.message
    return {
        "at": _ms(seen),
        "connected": status.connected,
        "fps": round(status.fps, 1),
        "age_ms": round(status.age_ms),
        "detail": status.detail,
    }


def _process(seen: StampedMessage[m.ProcessStatus]) -> dict[str, Any]:
    status = seen.message
    late = status.overruns / status.ticks if status.ticks else 0.0
    return {
        "at": _ms(seen),
        "state": status.state,
        "cpu": round(status.cpu, 3),
        "late": round(late, 4),
        "detail": status.detail,
    }


def _event(seen: StampedMessage[m.Event]) -> dict[str, Any]:
    event = seen.message
    return {
        "at": _ms(seen),
        "severity": event.severity,
        "entity": event.header.entity,
        "text": event.text,
        "remedy": event.remedy,
    }


def _switch(switch: Switch | None) -> dict[str, Any] | None:
    if switch is None:
        return None
    before, now = topology_words(switch.before), topology_words(switch.after)
    return {"at": switch.time_s * 1e3, "before": before, "now": now, "reason": switch.reason}


def _option(topology: str, cost_m2: float) -> dict[str, Any]:
    return {
        "topology": topology,
        "words": topology_words(topology),
        "cost_cm2": round(cost_cm2(cost_m2), 2),
        "cost": cost_text(cost_m2),
    }


def _plan(seen: StampedMessage[m.Plan] | None) -> dict[str, Any] | None:
    if seen is None:
        return None
    plan = seen.message
    others = sorted(plan.alternatives, key=lambda alternative: alternative.cost)[:_ALTERNATIVES]
    return {
        "at": _ms(seen),
        **_option(plan.topology, plan.cost),
        "mode": plan.mode,
        "controls": [
            {
                "robot": c.robot,
                "velocity": _rounded(c.velocity_m_s, 3),
                "wanted": None if c.wanted_m_s is None else _rounded(c.wanted_m_s, 3),
                "limited_by": c.limited_by,
            }
            for c in plan.controls
        ],
        "edges": [[e.observer, e.subject, round(e.information, 3)] for e in plan.edges],
        "alternatives": [{**_option(other.topology, other.cost), "bound_only": other.bound_only} for other in others],
        "solver": {
            "status": plan.solver.status,
            "ms": round(plan.solver.seconds * 1e3, 1),
            "evaluations": plan.solver.evaluations,
            "topologies": plan.solver.topologies,
            "survivors": plan.solver.survivors,
        },
    }
