"""A drone takes off again while another, which tracks, is asked to fly to and fro across its place."""

import math
from typing import Any

import msgspec
import numpy as np
import pytest

from groundstation import tracker
from groundstation.bus.messages import Command, Verb
from groundstation.control.flight_mode import FlightMode
from groundstation.control.setpoints import HOVER, Setpoint, setpoints_from_plan
from groundstation.estimation.belief import JointBelief
from groundstation.geometry.stabilized_frame import stabilized_from_world
from groundstation.settings.files import find_field
from groundstation.settings.load import load_field
from groundstation.settings.resolved import resolved_field
from groundstation.settings.sections import CAMERA, driver_sections
from groundstation.time_units import NS_PER_S
from sim_bridge.scenario import Scenario
from sim_bridge.study.faults.draw import Drawn
from sim_bridge.study.faults.flight import FaultFlight

SPEED_M_S, REACH_M = 0.5, 1.0
CROSSED_S, UP_S, LATEST_S = 5.0, 4.0, 60.0


class Crossing(FaultFlight):
    """nearest_m: least distance of both while drone_2 is off the floor again; crossings: times that drone_1 turned."""

    def __init__(self, *settings: Any) -> None:
        super().__init__(*settings)
        self.nearest_m, self.crossings, self._sign = math.inf, 0, 1.0
        self._landed_s = self._up_s = math.inf
        self._operator = self._bus("operator")

    def asked(self, belief: JointBelief) -> Setpoint:
        """Return the wish of drone_1: across the place of drone_2, once that stands."""
        if "drone_1" not in belief.layout or self.world.time_s < self._landed_s:
            return HOVER
        (x, y), yaw = belief.mean_of("drone_1")[:2], float(belief.mean_of("drone_1")[3])
        way = self.truth("drone_2")[:2] + np.array([self._sign * REACH_M - x, -y])
        if abs(way[0]) < 0.1 or self._sign * way[0] < 0.0:
            self._sign, self.crossings = -self._sign, self.crossings + 1
        velocity = SPEED_M_S * np.append(way / math.hypot(*way), 0.0)
        forward, left, _ = stabilized_from_world(velocity, yaw).tolist()
        return Setpoint((forward, left, 0.0), 0.0, FlightMode.TRACK)

    def truth(self, name: str) -> Any:
        return self.world.states()[list(self.world.bodies).index(name)]

    def order(self, verb: Verb) -> None:
        """Give drone_2 an order; a bus in memory brings each to all."""
        header, expires_ns = self._operator.header("team"), self.now_ns + NS_PER_S
        command = Command(
            header=header, id=f"{verb}-{self.now_ns}", verb=verb, scope=(), issuer="operator", expires_ns=expires_ns
        )
        self.drivers.hosts["drone_2"].watchdog.accept_command(self.now_ns, command)

    def watch(self) -> None:
        now_s, mode = self.world.time_s, self.drivers.hosts["drone_2"].watchdog.mode
        if mode == "TRACK":
            self.order(Verb.LAND)
        if mode == "LANDED":
            self._landed_s = min(now_s, self._landed_s)
            if now_s - self._landed_s > CROSSED_S:
                self.order(Verb.TAKEOFF)  # refused for as long as drone_1 is near
        if math.isfinite(self._landed_s) and not self.truth("drone_2")[12]:
            if mode == "HOVER":
                self._up_s = min(now_s, self._up_s)
            self.nearest_m = min(self.nearest_m, math.dist(self.truth("drone_1")[:3], self.truth("drone_2")[:3]))

    def is_over(self) -> bool:
        return self.world.time_s > min(LATEST_S, self._up_s + UP_S)


@pytest.mark.slow
@pytest.mark.study
def test_who_tracks_keeps_away_from_a_climb(monkeypatch: pytest.MonkeyPatch) -> None:
    field = load_field(find_field("lab"), ("recording.raw_datagrams=false",))
    sections = [(s.kind, s.section) for s in driver_sections(field) if s.kind != CAMERA]
    flight = Crossing(Drawn(msgspec.to_builtins(resolved_field(field)), Scenario(), 4), sections, LATEST_S)

    def wanted(plan: Any, belief: JointBelief, airborne: Any, *more: Any) -> dict[str, Setpoint]:
        return setpoints_from_plan(plan, belief, airborne, *more) | {"drone_1": flight.asked(belief)}

    monkeypatch.setattr(tracker, "setpoints_from_plan", wanted)
    flight.run()
    assert flight.nearest_m >= 0.6
    modes = {name: host.watchdog.mode for name, host in flight.drivers.hosts.items()}
    assert modes == {"drone_1": "TRACK", "drone_2": "HOVER"} and flight.crossings >= 2
