"""Drones on the ground are shown where a fixed camera sees them, until the filter contains them."""

import math

import pytest

from groundstation.bus import messages as m
from groundstation.console.standing import StandingDrones
from groundstation.field.room import WorldCamera
from groundstation.geometry.rotations import world_from_downward_optical
from groundstation.time_units import NS_PER_S

NOISE = (1e-4, 0.0, 0.0, 0.0, 1e-4, 0.0, 0.0, 0.0, 1e-4)
LANDED = {"drone_1": m.FlightState.LANDED}


@pytest.fixture
def standing(lab_camera: WorldCamera) -> StandingDrones:
    return StandingDrones({"ceiling": lab_camera}, ("drone_1", "drone_2"))


@pytest.fixture(scope="module")
def lab_camera() -> WorldCamera:
    from pathlib import Path

    from groundstation.settings.load import load_field
    from groundstation.settings.resolved import resolved_field

    return resolved_field(load_field(Path(__file__).parents[3] / "config" / "lab.yaml", [])).cameras["ceiling"]


def sighting(
    camera: WorldCamera, subject: str, place: tuple[float, float, float], observer: str = "ceiling"
) -> m.RelativeObservation:
    seen = world_from_downward_optical(camera.rotation_deg).T @ [
        a - b for a, b in zip(place, camera.position_m, strict=True)
    ]
    x, y, z = (float(value) for value in seen)
    header = m.Header(10 * NS_PER_S, "c", observer, "camera", 0)
    return m.RelativeObservation(
        header=header, observer=observer, subject=subject, camera=observer, position_m=(x, y, z), yaw_rad=None,
        covariance=NOISE,
    )  # fmt: skip


def test_it_stands_where_it_is_seen(standing: StandingDrones, lab_camera: WorldCamera) -> None:
    standing.see(sighting(lab_camera, "drone_1", (0.7, -0.4, 0.1)))
    (found,) = standing.now(11 * NS_PER_S, LANDED, ())
    assert found.name == "drone_1" and math.dist(found.place_m, (0.7, -0.4)) < 1e-9
    assert standing.now(14 * NS_PER_S, LANDED, ()) == (), "seen too long ago"


def test_one_that_flies_or_that_the_filter_has_is_not_drawn_twice(
    standing: StandingDrones, lab_camera: WorldCamera
) -> None:
    standing.see(sighting(lab_camera, "drone_1", (0.7, -0.4, 0.1)))
    assert standing.now(11 * NS_PER_S, {"drone_1": m.FlightState.FLYING}, ()) == ()
    assert standing.now(11 * NS_PER_S, LANDED, {"drone_1"}) == ()
    assert standing.now(11 * NS_PER_S, {}, ()) != (), "not connected yet, and seen"


def test_sightings_by_drones_and_of_targets_are_no_business_of_the_floor(
    standing: StandingDrones, lab_camera: WorldCamera
) -> None:
    standing.see(sighting(lab_camera, "drone_2", (0.0, 0.0, 0.1), observer="drone_1"))
    standing.see(sighting(lab_camera, "turtlebot", (0.0, 0.0, 0.1)))
    assert standing.now(11 * NS_PER_S, {}, ()) == ()
