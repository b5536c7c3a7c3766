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


class Boasting(MissionFlight):
    """A mission whose drivers say at any time that they have landed."""

    def modes(self) -> dict[str, str]:
        return dict.fromkeys(super().modes(), "LANDED")


def mission(kind: type[MissionFlight], seconds: float) -> MissionFlight:
    field = load_field(find_field("lab"), ("recording.raw_datagrams=false",))
    sections = [(s.kind, s.section) for s in driver_sections(field) if s.kind != CAMERA]
    drawn = draw_mission(msgspec.to_builtins(resolved_field(field)), Scenario(), 3)
    return kind(drawn, sections, seconds, covariance_share=0.25)


@pytest.mark.slow
@pytest.mark.study
def test_a_mission_is_over_when_the_drones_stand_whatever_their_drivers_say() -> None:
    flight = mission(Boasting, 1.0)
    report = flight.fly()
    assert report["landed"] and not flight.world.airborne
    assert flight.world.time_s > report["landing_since_s"] + 1.0


@pytest.mark.slow
@pytest.mark.study
def test_a_team_whose_sightings_state_too_little_lands_within_the_fence() -> None:
    flight = mission(MissionFlight, 8.0)
    report = flight.fly()
    assert report["flown"] and report["landed"] and report["landed_before"] == []
    assert report["landing_since_s"] is not None and flight.world.time_s > report["landing_since_s"] + 1.0
    assert report["fence_m"] == 0.0 and report["separation_m"] >= 0.6
