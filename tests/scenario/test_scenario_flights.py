"""Flights of scenario files: the target is found and tracked; parts that a strategy leaves alone stay the same."""

import json
import math
import re
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import msgspec
import numpy as np
import pytest

from groundstation.arrays import Array
from groundstation.bus.messages import Message, ReportedMotion
from groundstation.settings.files import find_field, find_scenario
from groundstation.settings.load import load_field
from groundstation.settings.resolved import resolved_field
from groundstation.settings.scenario import load_scenario
from groundstation.settings.sections import CAMERA, driver_sections
from sim_bridge.fault_kinds import Fault, FaultKind
from sim_bridge.scenario import parse_scenario
from sim_bridge.study.faults.draw import Drawn
from sim_bridge.study.faults.stand_ins import manual_clock
from sim_bridge.study.faults.vehicles import Section
from sim_bridge.study.scenarios.flight import ScenarioFlight, as_drawn
from sim_bridge.world.ardrone import Quadrotor

pytestmark = [pytest.mark.slow, pytest.mark.study]
# A search of the whole room, a carried target, a pillar in the way, a sharp turn.
TELLING = ("corner", "kidnap-2m", "pillar", "sharp-turns-0.7")


def order(name: str, *options: str) -> tuple[Drawn, list[Section]]:
    """Return the launch specification of a scenario's flight in the lab, seed 1; options: of the field."""
    path = find_field("lab")
    scenario = parse_scenario(json.dumps(load_scenario(find_scenario(name, path))))
    field = load_field(path, ("recording.raw_datagrams=false", *options))
    sections = [(s.kind, s.section) for s in driver_sections(field) if s.kind != CAMERA]
    return as_drawn(msgspec.to_builtins(resolved_field(field)), scenario, 1), sections


@pytest.mark.timeout(3000)
@pytest.mark.parametrize("names", [TELLING, pytest.param((), id="all", marks=pytest.mark.exhaustive)], ids=" ".join)
def test_scenarios_end_as_their_files_expect(names: tuple[str, ...], tmp_path: Path) -> None:
    """One seed of each, or of all: target found in time and tracked, no drone lands."""
    command = [sys.executable, "-m", "groundstation", "experiment", "scenarios", *names, "--scheduler", "none"]
    flown = subprocess.run([*command, "-o", str(tmp_path)], capture_output=True, text=True, check=False)
    results = tmp_path / "scenarios.json"
    assert results.exists(), flown.stderr
    rows = json.loads(results.read_text())["rows"]
    assert len(rows) >= (len(names) or 20)
    assert not {row["scenario"]: row["missed"] for row in rows if row["missed"]}


@pytest.mark.parametrize("strategy", ["ours", "string", "relay", "chase"])
def test_a_target_that_wanders_is_found_and_held(strategy: str) -> None:
    flown = ScenarioFlight(*order("random-walk"), 8.0, strategy).fly()
    assert flown["flown"]
    assert flown["found_s"] is not None
    assert flown["lost_s"] == 0.0
    assert (flown["landings"], flown["violations"]) == (0, [])
    if strategy == "string":
        assert flown["switches"] <= 1


class HearingFlight(ScenarioFlight):
    """Records the target's reports to the tracker, and their age [ns]."""

    heard: list[tuple[ReportedMotion, int]] | None = None

    def heeds(self, message: Message) -> bool:
        if isinstance(message, ReportedMotion):
            self.heard = [*(self.heard or ()), (message, self.now_ns - message.header.stamp_ns)]
        return super().heeds(message)


def test_a_target_that_tells_its_odometry_is_heard_in_the_study() -> None:
    flight = HearingFlight(*order("random-walk", "target.odometry.source=ros2://127.0.0.1/odom"), 1.0, "ours")
    with manual_clock(lambda: flight.now_ns):
        while flight.world.time_s < 2.0:
            flight.step()
    assert flight.heard is not None and 38 <= len(flight.heard) <= 41, "20 a second"
    assert {message.header.entity for message, _ in flight.heard} == {"turtlebot"}
    assert all(20e6 <= age_ns <= 41e6 for _, age_ns in flight.heard), "late by delay_ms, and by a tick of the tracker"
    assert not [reason for reason in flight.tracking.tracker.rejected if "ReportedMotion" in reason]


class WatchedFlight(ScenarioFlight):
    """Records when the target is carried away."""

    carried_s: float | None = None
    _was: Array | None = None

    def watch(self) -> None:
        super().watch()
        place = np.array(dict(zip(self.world.bodies, self.world.states(), strict=True))["turtlebot"][:2])
        if self._was is not None and math.dist(place, self._was) > 1.0:
            self.carried_s = self.world.time_s
        self._was = place


def test_a_loss_is_told_within_a_second_with_where_the_target_may_be() -> None:
    kidnap = WatchedFlight(*order("kidnap-2m"), 22.0, "ours")
    assert kidnap.fly()["flown"]
    assert kidnap.carried_s is not None
    told = [(when_s, text) for when_s, text in kidnap.events if when_s >= kidnap.carried_s and "turtlebot" in text]
    assert told[0][0] - kidnap.carried_s <= 1.0
    assert re.search(r"is not seen for 0\.\d s: it may be hidden near \(-?\d\.\d, -?\d\.\d\)", told[0][1])


class CutFlight(ScenarioFlight):
    """Stops the motors of drone_1 at 10 s, without a fault of the file."""

    def watch(self) -> None:
        super().watch()
        drone = self.world.drones["drone_1"]
        if self.world.time_s >= 10.0 and isinstance(drone, Quadrotor):
            drone.autopilot.cut_motors()


def test_drones_that_fall_have_come_down_and_violate_where_the_file_does_not_stop_them() -> None:
    drawn, sections = order("random-walk")
    blocked = Fault(kind=FaultKind.PROPELLER_BLOCKED, entity="drone_2", start_s=10.0)
    drawn = replace(drawn, scenario=drawn.scenario.model_copy(update={"faults": (blocked,)}))
    flown = CutFlight(drawn, sections, 6.0, "ours").fly()
    assert flown["landings"] == 2
    assert [line.split(" at ")[0] for line in flown["violations"]] == ["drone_1 fell"]
    assert set(flown["reasons"]) == {"drone_1", "drone_2"}
    assert "landings 2 > 0" in flown["missed"]
