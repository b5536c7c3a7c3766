"""Converts messages to the page's sections of the board, as JSON values. Pure."""

from collections.abc import Iterable
from dataclasses import asdict
from typing import Any

from groundstation.appearance.cost import cost_cm2, cost_text
from groundstation.appearance.topology import topology_words
from groundstation.bus import messages as m
from groundstation.monitor.alarm import Alarm
from groundstation.monitor.alarms import DARK
from groundstation.monitor.batteries import Battery
from groundstation.monitor.state import StampedMessage
from groundstation.monitor.whereabouts import is_anywhere
from groundstation.sensing.switches import Switch

_ALTERNATIVES = 8


def alarm(alarm: Alarm) -> dict[str, Any]:
    """An alarm; told: when it was reported [ms]."""
    values = asdict(alarm)
    told_ns = values.pop("told_ns")
    return {**values, "asks": alarm.asks, "told": None if told_ns is None else told_ns / 1e6}


def milliseconds(seen: StampedMessage[Any]) -> float:
    """Return the stamp of a message [ms]."""
    return seen.stamp_ns / 1e6


def rounded(values: Iterable[float], digits: int = 4) -> list[float]:
    """Return figures as short as the page needs them."""
    return [round(value, digits) for value in values]


def estimate(seen: StampedMessage[m.Estimate] | None, room_m: tuple[float, float]) -> dict[str, Any] | None:
    """The estimates of all entities; None before the first estimate.

    anywhere: it has no place to show in a room of that length and width [m].
    """
    if seen is None:
        return None
    entities = [
        {
            "name": entity.name,
            "kind": entity.kind,
            "mean": rounded(entity.mean),
            # Horizontal part only: xx, xy, yy [m^2].
            "cov": rounded((entity.covariance[0], entity.covariance[1], entity.covariance[len(entity.mean) + 1]), 7),
            "velocity": rounded(entity.velocity_m_s, 3),
            "converged": entity.converged,
            "anywhere": is_anywhere(entity, room_m),
            # Never seen is infinite in the filter, which JSON cannot express.
            "age_s": round(min(entity.age_s, 1e6), 2),
            "unplaced_s": round(min(entity.unlocalised_s, 1e6), 2),
        }
        for entity in seen.message.entities
    ]
    searches = {search.target: [search.mode, search.text] for search in seen.message.searches}
    return {"at": milliseconds(seen), "epoch": seen.message.epoch, "entities": entities, "searches": searches}


def search_map(seen: m.SearchMap) -> dict[str, Any]:
    """Where a target may be."""
    return {"first": seen.first_m, "cell": seen.cell_m, "columns": seen.columns, "chances": seen.chances}


def setpoint(seen: StampedMessage[m.VelocitySetpoint]) -> dict[str, Any]:
    """The setpoint of a drone."""
    setpoint = seen.message
    return {
        "at": milliseconds(seen),
        "velocity": rounded(setpoint.velocity_m_s, 3),
        "yaw_rate": round(setpoint.yaw_rate_rad_s, 3),
        "converged": setpoint.converged,
    }


def truth(seen: StampedMessage[m.TruthState]) -> dict[str, Any]:
    """The true place of a simulated body."""
    truth = seen.message
    return {"at": milliseconds(seen), "position": rounded(truth.position_m, 3), "yaw": round(truth.attitude_rad[2], 4)}


def vehicle(seen: StampedMessage[m.VehicleStatus]) -> dict[str, Any]:
    """The reports of a drone on itself, but its battery."""
    status = seen.message
    return {
        "at": milliseconds(seen),
        "mode": status.mode,
        "flight": status.flight_state,
        "link": status.link_quality,
        "rate_hz": round(status.rate_hz, 1),
        "detail": status.detail,
        "braked": status.braked,
        "lands_in_s": None if status.lands_in_s is None else round(status.lands_in_s, 1),
        "rejected": sum(status.rejected.values()),
    }


def battery(battery: Battery) -> dict[str, Any]:
    """Charge of a battery, and the remaining time."""
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


def camera(seen: StampedMessage[m.CameraStatus]) -> dict[str, Any]:
    """The health of a camera."""
    status = seen.message
    return {
        "at": milliseconds(seen),
        "connected": status.connected,
        "fps": round(status.fps, 1),
        "age_ms": round(status.age_ms),
        "dark": status.brightness is not None and status.brightness < DARK,
        "detail": status.detail,
    }


def process(seen: StampedMessage[m.ProcessStatus]) -> dict[str, Any]:
    """State, CPU use and deadlines of a process."""
    status = seen.message
    late = status.overruns / status.ticks if status.ticks else 0.0
    return {
        "at": milliseconds(seen),
        "state": status.state,
        "cpu": round(status.cpu, 3),
        "late": round(late, 4),
        "detail": status.detail,
    }


def event(seen: StampedMessage[m.Event]) -> dict[str, Any]:
    """An event."""
    event = seen.message
    return {
        "at": milliseconds(seen),
        "severity": event.severity,
        "entity": event.header.entity,
        "text": event.text,
        "remedy": event.remedy,
    }


def switch(switch: Switch | None) -> dict[str, Any] | None:
    """The last change of topology; None before it."""
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


def plan(seen: StampedMessage[m.Plan] | None) -> dict[str, Any] | None:
    """The chosen topology with its alternatives; None before the first plan."""
    if seen is None:
        return None
    plan = seen.message
    others = sorted(plan.alternatives, key=lambda alternative: alternative.cost)[:_ALTERNATIVES]
    return {
        "at": milliseconds(seen),
        **_option(plan.topology, plan.cost),
        "mode": plan.mode,
        "controls": [
            {
                "robot": c.robot,
                "velocity": rounded(c.velocity_m_s, 3),
                "wanted": None if c.wanted_m_s is None else rounded(c.wanted_m_s, 3),
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
