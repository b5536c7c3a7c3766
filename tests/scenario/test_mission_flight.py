"""A mission ends with the LAND command, and is judged until all drones have landed."""

import msgspec
import pytest

from groundstation.settings.files import find_field
from groundstation.settings.load import load_field
from groundstation.settings.resolved import resolved_field
from groundstation.settings.sections import CAMERA, driver_sections
from sim_bridge.scenario import Scenario
from sim_bridge.study.missions.draw import draw_mission
from sim_bridge.study.missions.flight import MissionFlight


@pytest.mark.slow
@pytest.mark.study
def test_a_team_whose_sightings_state_too_little_lands_within_the_fence() -> None:
    field = load_field(find_field("lab"), ("recording.raw_datagrams=false",))
    sections = [(s.kind, s.section) for s in driver_sections(field) if s.kind != CAMERA]
    drawn = draw_mission(msgspec.to_builtins(resolved_field(field)), Scenario(), 3)
    flight = MissionFlight(drawn, sections, 8.0, covariance_share=0.25)
    report = flight.fly()
    assert report["flown"] and report["landed"] and report["landed_before"] == []
    assert report["landing_since_s"] is not None and flight.world.time_s > report["landing_since_s"] + 1.0
    assert report["fence_m"] == 0.0 and report["separation_m"] >= 0.6
