"""Flights of the fault campaign: drivers, watchdogs and tracker, hosted in one thread."""

from typing import Any

import msgspec
import pytest

from groundstation.settings.files import find_field
from groundstation.settings.load import load_field
from groundstation.settings.resolved import resolved_field
from groundstation.settings.sections import CAMERA, driver_sections
from sim_bridge.fault_kinds import Fault, FaultKind
from sim_bridge.scenario import Scenario
from sim_bridge.study.faults.draw import Drawn
from sim_bridge.study.faults.flight import FaultFlight
from sim_bridge.study.scenarios.flight import ScenarioFlight

SECONDS = 10.0


def fly(field_name: str, *faults: Fault, seconds: float = SECONDS, seed: int = 3) -> dict[str, Any]:
    field = load_field(find_field(field_name), ("recording.raw_datagrams=false",))
    sections = [(s.kind, s.section) for s in driver_sections(field) if s.kind != CAMERA]
    scenario = Scenario().model_copy(update={"faults": faults})
    flight = FaultFlight(Drawn(msgspec.to_builtins(resolved_field(field)), scenario, seed), sections, seconds)
    return flight.run() | {"events": [line for _, line in flight.events]}


@pytest.fixture(scope="module")
def silent() -> dict[str, Any]:
    return fly("lab", Fault(kind=FaultKind.NAVDATA_SILENT, entity="drone_1", start_s=9.0))


def test_a_silent_drone_is_stopped_and_landed_by_its_driver(silent: dict[str, Any]) -> None:
    assert silent["unsafe"] == {}
    assert silent["hover_s"] <= 0.5
    assert silent["modes"]["drone_1"] in ("LANDING", "LANDED")
    assert silent["modes"]["drone_2"] == "TRACK"
    assert "no telemetry from the vehicle" in silent["reasons"]["drone_1"]


def test_injected_faults_are_listed_among_the_events(silent: dict[str, Any]) -> None:
    assert "fault navdata_silent of drone_1 begins" in silent["events"]
    assert any(line.startswith("drone_1 LANDING: no telemetry") for line in silent["events"])


def test_a_drone_is_judged_from_its_lift_off_though_the_team_never_tracks() -> None:
    """The wind carries it out of the fence while the other one stands on its pad, silent."""
    silent = Fault(kind=FaultKind.NAVDATA_SILENT, entity="drone_2", start_s=0.0)
    gust = Fault(kind=FaultKind.WIND, entity="drone_1", start_s=8.0, value=5.0)
    flown = fly("lab", silent, gust)
    assert flown["tracking_since_s"] is None
    assert set(flown["unsafe"]) & {"fence", "speed"}


@pytest.mark.slow
def test_a_seed_ends_the_same_again(silent: dict[str, Any]) -> None:
    again = fly("lab", Fault(kind=FaultKind.NAVDATA_SILENT, entity="drone_1", start_s=9.0))
    assert {k: v for k, v in again.items() if k != "spent_s"} == {k: v for k, v in silent.items() if k != "spent_s"}


@pytest.mark.slow
def test_nobody_flies_on_by_a_ceiling_picture_that_hangs() -> None:
    frozen = fly("lab", Fault(kind=FaultKind.PICTURE_FROZEN, entity="ceiling", start_s=9.5), seconds=9.0)
    assert frozen["unsafe"] == {}
    assert 0.4 <= frozen["hover_s"] <= 1.0
    assert frozen["rest_s"] <= 3.5


@pytest.mark.slow
@pytest.mark.parametrize("degrees", [180.0, 90.0])
def test_nobody_flies_the_wrong_way_by_a_body_that_motion_capture_turns(degrees: float) -> None:
    turned = fly(
        "mocap-lab", Fault(kind=FaultKind.BODY_TURNED, entity="drone_1", start_s=16.0, value=degrees), seconds=14.0
    )
    assert turned["unsafe"] == {} and turned["modes"]["drone_1"] == "TRACK"
    assert turned["speed_m_s"] < 0.6 and turned["separation_m"] > 0.9
    assert not any("re-initialised" in line for line in turned["events"] if line.startswith("drone_1"))
    assert any("mocap sees it turned" in line for line in turned["events"])


@pytest.mark.slow
def test_an_anchor_that_holds_its_ranges_pulls_nobody_along() -> None:
    held = Fault(kind=FaultKind.ANCHOR_FROZEN, entity="uwb", other="a1", start_s=16.0)
    flown = fly("uwb-lab", held, seconds=20.0)
    assert flown["unsafe"] == {} and flown["modes"] == {"drone_1": "TRACK", "drone_2": "TRACK"}
    assert not any("contradicts" in line or "re-initialised by uwb" in line for line in flown["events"])


@pytest.mark.slow
def test_vehicles_of_all_kinds_are_flown_by_their_drivers() -> None:
    flown = fly("mixed-team", Fault(kind=FaultKind.NAVDATA_SILENT, entity="drone_2", start_s=15.0), seconds=5.0)
    assert flown["tracking_since_s"] is not None
    assert flown["modes"]["drone_1"] == flown["modes"]["drone_3"] == "TRACK"
    assert flown["modes"]["drone_2"] != "TRACK"


@pytest.mark.slow
@pytest.mark.study
@pytest.mark.parametrize("name", ["uwb-lab", "mocap-lab"])
def test_a_team_without_a_ceiling_camera_is_placed_by_what_its_field_has(name: str) -> None:
    field = load_field(find_field(name), ("recording.raw_datagrams=false",))
    sections = [(s.kind, s.section) for s in driver_sections(field) if s.kind != CAMERA]
    values = msgspec.to_builtins(resolved_field(field))
    flight = ScenarioFlight(Drawn(values, Scenario(), 3), sections, 6.0, "ours")
    told = flight.fly()
    assert told["found_s"] is not None and told["rmse_m"] < 0.3, told
    assert flight.judge.lost_s < 1.0


@pytest.mark.slow
def test_a_vehicle_whose_heading_is_off_is_stopped_before_its_velocity_swings_up() -> None:
    """Seed 610026 of `mixed-team`: 1.08 m/s, 13 s after the jump."""
    turned = fly("mixed-team", Fault(kind=FaultKind.HEADING_JUMPING, entity="drone_3", start_s=18.7, value=68.0))
    assert turned["unsafe"] == {}
    assert "heading is off by" in turned["reasons"]["drone_3"]


@pytest.mark.slow
def test_a_drone_that_hears_again_in_wind_is_not_carried_off() -> None:
    """Seed 610038 of `mixed-team`: 1.45 m/s, braked from a speed that it never had."""
    wind = Fault(kind=FaultKind.WIND, entity="drone_1", start_s=10.0, value=1.6)
    deaf = Fault(kind=FaultKind.AT_DEAF, entity="drone_1", start_s=12.0, end_s=14.0)
    flown = fly("lab", wind, deaf, seconds=12.0)
    assert flown["unsafe"] == {} and flown["speed_m_s"] < 0.8
    assert "does not see the floor" not in flown["reasons"]["drone_1"]


def test_a_drone_without_a_floor_does_not_track_on_by_the_integral_of_its_tilts() -> None:
    floor = Fault(kind=FaultKind.UNIFORM_FLOOR, entity="drone_2", start_s=9.5, value=2.0)
    flown = fly("lab", floor, seconds=9.0, seed=8)
    assert flown["unsafe"] == {}
    assert "sensors cannot be believed" in flown["reasons"]["drone_2"], flown
