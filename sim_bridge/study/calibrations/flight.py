"""One flight with wrong figures, kept like a recording and judged by the truth."""

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from groundstation.bus import clock
from groundstation.bus.messages import Message
from groundstation.bus.topics import IMU, OBSERVATION, ODOMETRY, VEHICLE_STATUS
from groundstation.calibration.flown import Flown
from groundstation.calibration.team import calibrate_team
from groundstation.errors import OperatorMistake
from groundstation.field.resolved import ResolvedField
from groundstation.geometry.rotations import base_from_tilted_optical, world_from_downward_optical
from sim_bridge.study.camera_model import Eye
from sim_bridge.study.faults.draw import Drawn
from sim_bridge.study.faults.flight import JUDGE_S
from sim_bridge.study.faults.stand_ins import manual_clock
from sim_bridge.study.faults.vehicles import Section
from sim_bridge.study.scenarios.flight import ScenarioFlight
from sim_bridge.study.score import FlightScore
from sim_bridge.study.wrong_figures import WrongFigures

_TAKEN = (ODOMETRY, IMU, OBSERVATION, VEHICLE_STATUS)


class CalibrationFlight(ScenarioFlight):
    """A flight whose team first stands on its pads; `fly` returns rmse, ANEES and the figures' remaining errors."""

    def __init__(
        self, drawn: Drawn, sections: Sequence[Section], seconds: float, wrong: WrongFigures, stand_s: float
    ) -> None:
        super().__init__(drawn, sections, seconds, "ours", wrong)
        self._stand_s, self._score = stand_s, FlightScore(JUDGE_S)
        self._inputs = self._bus("calibration").subscribe(_TAKEN, capacity=8192)
        self._ticks: list[tuple[int, tuple[tuple[str, Message], ...]]] = []

    def may_start(self) -> bool:
        """Return whether the team has stood for long enough."""
        return bool(self.world.time_s >= self._stand_s)

    def step(self) -> None:
        """Advance by a tick, and keep the messages that arrived."""
        super().step()
        found = [(str(one.key), one.message) for one in self._inputs.drain() if one.message is not None]
        if found:
            self._ticks.append((self.now_ns, tuple(found)))

    def watch(self) -> None:
        """Compare the belief with the truth."""
        super().watch()
        tracker = self.tracking.tracker
        truth = dict(zip(self.world.bodies, self.world.states(), strict=True))
        ages_s = {name: tracker.filter.age_s(name) for name in tracker.belief.layout.robots}
        self._score.take(tracker.belief, truth, tuple(self.world.targets), str(tracker.topology), ages_s)

    def settings(self) -> list[tuple[list[str], Any]]:
        """Return the settings that `calibrate team` would change, as (path, value); none if its data are too few."""
        with manual_clock(lambda: self.now_ns):
            flown = Flown(tuple(self._ticks), clock.clock_id())
        try:
            found = calibrate_team(flown, self._field)
        except OperatorMistake:
            return []
        return [(list(path), value) for path, value in found.settings.items()]

    def fly(self) -> dict[str, Any]:
        """Fly to the end."""
        report = super().fly()
        anees = self._score.report()["anees"] if report["flown"] else {}
        of_targets = [anees[name] for name in self.world.targets if name in anees]
        left = left_wrong(self._field, self._wrong, {name: wrong.eye for name, wrong in self._eyes.items()})
        return {**report, "anees": max(of_targets, default=None), "left": left}


def left_wrong(told: ResolvedField, wrong: WrongFigures, eyes: Mapping[str, Eye]) -> dict[str, dict[str, float]]:
    """Return true minus told figures, with drawn errors: of cameras turn [deg], place [m], focal [share], delay [ms].

    Of markers: print [share].
    """
    found = {name: _of_eye(told, name, eye) for name, eye in eyes.items()}
    for (who, part), error in wrong.errors.items():
        if part == "delay":
            found[who]["delay"] = error
        elif part == "focal":
            found[who]["focal"] = (1.0 + found[who]["focal"]) * (1.0 + error) - 1.0
        elif part == "print":
            found.setdefault(who, {})["print"] = error
    return found


def _of_eye(told: ResolvedField, name: str, eye: Eye) -> dict[str, float]:
    if name in told.cameras:
        camera = told.cameras[name]
        rotation, place, lens = world_from_downward_optical(camera.rotation_deg), camera.position_m, camera.calibration
    else:
        mount = told.drones[name].camera
        rotation = base_from_tilted_optical(math.radians(mount.tilt_down_deg), math.radians(mount.pan_left_deg))
        place, lens = mount.position_m, mount.calibration
    true_rotation, true_place, true_lens = eye.truth
    cosine = 0.5 * (float(np.trace(rotation.T @ true_rotation)) - 1.0)
    return {
        "turn": math.degrees(math.acos(min(1.0, max(-1.0, cosine)))),
        "place": float(np.linalg.norm(true_place - np.array(place))),
        "focal": true_lens.fx_px / lens.fx_px - 1.0,
        "delay": 0.0,
    }
