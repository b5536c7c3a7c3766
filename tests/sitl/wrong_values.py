"""A flight at the wire in which one value goes wrong during tracking, judged by truth as in the fault campaign."""

import json
import math
import time
from bisect import bisect_right
from collections.abc import Callable
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
from sitl_run import SitlRun
from wire_tap import WireTap

from groundstation.arrays import Array
from groundstation.bus.messages import Event, TruthState, VehicleStatus
from groundstation.bus.topics import EVENT, VEHICLE_STATUS
from groundstation.settings.files import find_field
from groundstation.settings.load import load_field
from groundstation.settings.resolved import resolved_field
from sim_bridge.fault_kinds import Fault, FaultKind
from sim_bridge.study.faults.judge import Judge

# Both drones track by then on a slow machine too; the reaction takes at most 3.5 s once the fault shows.
START_S, _WATCHED_S = 30.0, 12.0
_PERIOD_S = 0.05
_NOTICED_M_S = 0.15
_SAYS_STILL = frozenset({FaultKind.VELOCITY_STUCK, FaultKind.UNIFORM_FLOOR})


def fly(sitl: Callable[..., SitlRun], tap: WireTap, fault: Fault, folder: Path) -> dict[str, Any]:
    """Fly the lab until the fault was observed long enough; returns the judge's verdict, and the events."""
    scenario = folder / "fault.yaml"
    row = fault.model_dump(mode="json", exclude_none=True)
    scenario.write_text(json.dumps({"schema_version": 1, "cameras": {"fps": 6}, "faults": [row]}))
    run = sitl("--scenario", str(scenario))
    run.until_tracking()
    tracking_s = time.monotonic()
    run.until(lambda: _begun_s(run) is not None, 2 * START_S, "the fault begins")
    begun_s = _begun_s(run) or math.nan
    run.until(lambda: time.monotonic() > begun_s + _WATCHED_S, 2 * _WATCHED_S)
    return _verdict(run, tap, fault, tracking_s, begun_s) | {
        "said": run.events(),
        "modes": {name: run.mode(name) for name in run.record.drones},
    }


def _begun_s(run: SitlRun) -> float | None:
    """Return the simulator's start time of its fault; None: not yet."""
    heard = [entry for (topic, _), entries in run.history.items() if topic == EVENT.name for entry in entries]
    return next((at_s for at_s, m in heard if isinstance(m, Event) and m.text.endswith(" begins")), None)


def _verdict(run: SitlRun, tap: WireTap, fault: Fault, tracking_s: float, begun_s: float) -> dict[str, Any]:
    """Judge from TRACK on. The belief is not on the wire: here no drone counts as unlocalised."""
    field = resolved_field(load_field(find_field("lab")))
    limits = {name: drone.limits.max_speed_m_s for name, drone in field.drones.items()}
    judge = Judge(msgspec.to_builtins(field.room), limits, _PERIOD_S, root="ceiling")
    tracks = {name: run.truth(name) for name in limits}
    tells = {name: tap.heard[run.address(name)] for name in limits}
    observable_s = None
    for now_s in np.arange(tracking_s, begun_s + _WATCHED_S, _PERIOD_S):
        states = {name: _newest(track, float(now_s)) for name, track in tracks.items()}
        truth = {name: _row(state) for name, state in states.items()}
        told = {name: _moves(tells[name], float(now_s)) and _follows(run, name, float(now_s)) for name in limits}
        judge.see(float(now_s), truth, told, {name: row[:2] for name, row in truth.items()})
        if observable_s is None and now_s >= begun_s and _shows(fault, states.get(fault.entity)):
            observable_s = float(now_s)
    return judge.verdict((fault,), (observable_s,))


def _newest(track: list[tuple[float, TruthState]], now_s: float) -> TruthState:
    return track[max(0, bisect_right(track, now_s, key=lambda entry: entry[0]) - 1)][1]


def _row(state: TruthState) -> Array:
    """Return a state as a row of the simulator's truth board."""
    return np.array(
        [*state.position_m, *state.velocity_m_s, *state.attitude_rad, 0.0, 0.0, 0.0, float(state.on_ground)]
    )


def _moves(heard: list[tuple[float, bool, bool]], now_s: float) -> bool:
    """Return whether the last datagram to a drone had a velocity."""
    last = bisect_right(heard, now_s, key=lambda entry: entry[0]) - 1
    return last >= 0 and heard[last][1]


def _follows(run: SitlRun, drone: str, now_s: float) -> bool:
    """Return whether a drone's driver follows setpoints: one that brakes a drone without floor sends motion as well."""
    known = run.history[VEHICLE_STATUS.name, drone]
    _, status = known[max(0, bisect_right(known, now_s, key=lambda entry: entry[0]) - 1)]
    return isinstance(status, VehicleStatus) and status.mode == "TRACK" and not status.braked


def _shows(fault: Fault, state: TruthState | None) -> bool:
    """Return whether a wrong value differs from the truth by more than noise explains; other faults show at once."""
    if state is None or fault.kind not in _SAYS_STILL:
        return True
    yaw = state.attitude_rad[2] + math.radians(fault.direction_deg)
    says_m_s = fault.amount if fault.kind is FaultKind.VELOCITY_STUCK else 0.0
    off = (state.velocity_m_s[0] - says_m_s * math.cos(yaw), state.velocity_m_s[1] - says_m_s * math.sin(yaw))
    return math.hypot(*off) > _NOTICED_M_S
