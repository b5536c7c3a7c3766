"""Tags, the second kind of marker, from field file through rendering to pose: signs, consistency, identity."""

import math

import cv2
import numpy as np
import pytest

from drivers.camera import pose
from drivers.camera.convert import stabilized_from_optical
from drivers.camera.pipeline import Pipeline
from drivers.camera.prediction import Prediction
from drivers.camera.settings import DetectorSettings, MarkerSettings, MountSettings, TagSettings
from drivers.camera.tags import TagFinder
from groundstation.errors import SettingsError
from groundstation.geometry.angles import wrap
from groundstation.geometry.lens import CameraIntrinsics
from groundstation.geometry.pose import Pose
from groundstation.geometry.rotations import base_from_tilted_optical
from groundstation.geometry.tag import SquareTag
from groundstation.sensing.from_field import sensors_from_field
from groundstation.settings.files import find_field
from groundstation.settings.load import load_field
from groundstation.settings.resolved import resolved_field
from groundstation.settings.sections import driver_sections
from sim_bridge.cameras import render_specs
from sim_bridge.render.renderer import Renderer
from sim_bridge.render.scene import compose_scene
from sim_bridge.render.spec import BoardSpec, BodyShape, Mount, PictureQuality, RenderSpec
from sim_bridge.scenario import Scenario
from sim_bridge.site import parse_site

FRONT = CameraIntrinsics(640, 360, 460.0, 460.0, 319.5, 179.5, (-0.30, 0.08, 0.0, 0.0, 0.0))
MOUNT = MountSettings(parent="drone_1", tilt_down_deg=45.0)
FAMILIES = ("DICT_APRILTAG_36H11", "DICT_4X4_50")
FRAME_NS = 66_666_667


def marker(family, number=7):
    return MarkerSettings(entity="bot", tag=TagSettings(dictionary=family, id=number, size_mm=168.0))


def state(x, y, z, yaw=0.0):
    return [x, y, z, 0.0, 0.0, 0.0, 0.0, 0.0, yaw, 0.0, 0.0, 0.0, 0.0]


def renderer_of(family, number=7, scenario=PictureQuality(exposure_ms=0.0)):  # noqa: B008  frozen
    mount = Mount(Pose(base_from_tilted_optical(math.radians(45)), np.zeros(3)), "drone_1")
    board = BoardSpec("bot", 0, 0.0, (0.0, 0.0, 0.4), BodyShape.TURTLEBOT, SquareTag(family, number, 168.0))
    return Renderer(RenderSpec("c", mount, FRONT, (board,), "t", ("drone_1", "bot"), "127.0.0.1", 0, scenario))


def gravity(_entity):
    return pose.Gravity(stabilized_from_optical(MOUNT, 0.0, 0.0), 0.0, 0.0, True)


@pytest.mark.parametrize("family", FAMILIES)
def test_a_tag_by_hand(family):
    """Camera 45 deg down at 1.6 m; the tag 1.2 m ahead, 0.3 m to the left, 1.2 m below, turned left by 20 deg."""
    pipeline = Pipeline(FRONT, (marker(family),), DetectorSettings(), search_rate_hz=2.0)
    picture = renderer_of(family).render(np.array([state(0, 0, 1.6), state(1.2, 0.3, 0.0, math.radians(20))]))
    (sighting,) = pipeline.process(picture, 0, gravity)
    best = sighting.choice.best
    assert sighting.entity == "bot"
    assert best.position_m == pytest.approx([-0.3, 0.0, 1.6971], abs=0.03)
    assert math.degrees(best.yaw_rad) == pytest.approx(20.0, abs=2.0)
    assert pipeline.tracked == ("bot",)


def test_tags_are_followed_without_searching_and_measured_honestly():
    random, errors, seen = np.random.default_rng(1), [], 0
    renderer = renderer_of(FAMILIES[0])
    pipeline = Pipeline(FRONT, (marker(FAMILIES[0]),), DetectorSettings(), search_rate_hz=2.0)
    for k in range(60):
        bot = state(1.5 + 0.4 * math.sin(k / 11), 0.3 * math.sin(k / 7), 0.0, 0.05 * k)
        states = np.array([state(0, 0, 2.0), bot])
        truth = compose_scene(renderer._spec, states).sights[0].optical_from_marker.translation
        sightings = pipeline.process(renderer.render(states), k * FRAME_NS, gravity)
        seen += len(sightings)
        for sighting in sightings:
            best = sighting.choice.best
            error = np.append(best.position_m - truth, wrap(best.yaw_rad - bot[8]))
            errors.append(error @ np.linalg.solve(best.covariance, error) / 4)
        random.random()
    assert seen >= 55
    assert pipeline.counts["searches"] <= 5
    assert 0.02 < np.mean(errors) < 1.5


def test_another_id_is_not_reported():
    pipeline = Pipeline(FRONT, (marker(FAMILIES[0], 8),), DetectorSettings(), search_rate_hz=2.0)
    picture = renderer_of(FAMILIES[0]).render(np.array([state(0, 0, 1.6), state(1.2, 0.0, 0.0)]))
    for k in range(20):
        assert pipeline.process(picture, k * FRAME_NS, gravity) == []


REAL, SPARE = (100, 60), (450, 250)


def prints_at(places, seed):
    """Return a picture with prints of one tag, of 48 px each, at these corners [px]."""
    tag = cv2.aruco.generateImageMarker(cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_4X4_50), 7, 48)
    picture = np.full((360, 640), 200, np.uint8)
    for x, y in places:
        picture[y : y + 48, x : x + 48] = tag
    noise = np.random.default_rng(seed).normal(0.0, 2.0, picture.shape)
    return np.clip(cv2.GaussianBlur(picture, (0, 0), 0.7) + noise, 0, 255).astype(np.uint8)


def looks_at(places, predictions, pictures=30):
    """Return the sightings in each picture in which these prints are to be seen, and the finder's pipeline."""
    pipeline = Pipeline(FRONT, (marker("DICT_4X4_50"),), DetectorSettings(), search_rate_hz=2.0)
    looks = [pipeline.process(prints_at(places, k), k * FRAME_NS, gravity, predictions) for k in range(pictures)]
    return looks, pipeline


@pytest.mark.parametrize("places", [(REAL, SPARE), (SPARE, REAL), ((100, 60), (160, 60))])
def test_a_spare_print_is_the_alternative_to_the_one_where_the_estimate_is(places):
    """In every picture, also between full searches, and whichever OpenCV names first."""
    expected = Prediction(np.array([REAL[0] + 24.0, REAL[1] + 24.0]), 34.0, 48.0, 8.0)
    looks, pipeline = looks_at(places, {"bot": expected})
    for sightings in looks:
        (sighting,) = sightings
        assert sighting.corners.mean(axis=0) == pytest.approx(expected.centre, abs=2.0)
        apart_m = sighting.choice.alternative.position_m - sighting.choice.best.position_m
        assert np.linalg.norm(apart_m) > 0.15
    assert pipeline.counts["searches"] <= 3
    assert len(pipeline.take_notices()) == 1


@pytest.mark.parametrize("places", [(REAL, SPARE), (SPARE, REAL)])
def test_without_an_estimate_neither_of_two_prints_is_reported(places):
    looks, _ = looks_at(places, {})
    assert not any(looks)


def test_a_tag_is_found_where_the_estimate_is_though_a_spare_print_is_followed():
    """The real one comes into view where no search has been; the spare one has been followed for a while."""
    pipeline = Pipeline(FRONT, (marker("DICT_4X4_50"),), DetectorSettings(), search_rate_hz=2.0)
    expected = {"bot": Prediction(np.array([REAL[0] + 24.0, REAL[1] + 24.0]), 34.0, 48.0, 8.0)}
    for k in range(12):
        pipeline.process(prints_at([SPARE], k), k * FRAME_NS, gravity, expected)
    (sighting,) = pipeline.process(prints_at([SPARE, REAL], 12), 12 * FRAME_NS, gravity, expected)
    assert sighting.corners.mean(axis=0) == pytest.approx(expected["bot"].centre, abs=2.0)
    assert not pipeline.searched


TAGGED = [
    "drones.drone_2.marker={kind: aruco, dictionary: DICT_APRILTAG_36H11, id: 7, size_mm: 168}",
]


def test_the_field_file_chooses_the_kind_of_each_marker():
    field = load_field(find_field("lab"), TAGGED)
    ceiling = next(part for part in driver_sections(field) if part.name == "ceiling")
    assert '"tag":{"dictionary":"DICT_APRILTAG_36H11","id":7,"size_mm":168.0}' in ceiling.section
    specs = render_specs(parse_site(field.model_dump(mode="json")), Scenario(), {"ceiling": ("127.0.0.1", 1)}, "t", 1)
    assert {board.body: board.tag for board in specs[0].boards} == {
        "drone_1": None,
        "drone_2": SquareTag("DICT_APRILTAG_36H11", 7, 168.0),
        "turtlebot": None,
    }
    ordinary = sensors_from_field(resolved_field(load_field(find_field("lab"))))
    reach = sensors_from_field(resolved_field(field)).world["ceiling"].view.range_m
    assert reach == pytest.approx(ordinary.world["ceiling"].view.range_m, rel=0.02)


def test_one_tag_belongs_to_one_robot():
    both = [*TAGGED, TAGGED[0].replace("drone_2", "drone_1")]
    with pytest.raises(SettingsError) as caught:
        load_field(find_field("lab"), both)
    assert "DICT_APRILTAG_36H11 7 is already that of drone_1" in caught.value.problems[0]


def small_tag(seed):
    """Return a picture of one small, slanted tag in uneven light, and its rough side [px]."""
    random, family = np.random.default_rng(seed), FAMILIES[seed % 2]
    code = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, family)).generateImageMarker(7, 160)
    card = cv2.copyMakeBorder(code, 30, 30, 30, 30, cv2.BORDER_CONSTANT, value=255)
    side, turn, slant = random.uniform(16.0, 40.0), random.uniform(0.0, 6.28), random.uniform(0.6, 1.0)
    scale = side / 160.0 * np.array([[math.cos(turn), -math.sin(turn)], [math.sin(turn), math.cos(turn)]])
    scale = np.diag([1.0, slant]) @ scale
    place = np.column_stack((scale, random.uniform((150, 100), (490, 260)) - scale @ (110.0, 110.0)))
    grey = random.normal(0.0, 30.0, (36, 64)).astype(np.float32)
    grey = 120.0 + cv2.resize(grey, (640, 360), interpolation=cv2.INTER_CUBIC)
    shrunk = cv2.warpAffine(card, place, (640, 360), flags=cv2.INTER_AREA)
    mask = cv2.warpAffine(np.full_like(card, 255), place, (640, 360), flags=cv2.INTER_AREA) / 255.0
    shown = cv2.GaussianBlur(grey * (1.0 - mask) + (0.5 * shrunk + 50.0) * mask, (0, 0), 0.7)
    return family, np.clip(shown + random.normal(0.0, 4.0, shown.shape), 0, 255).astype(np.uint8)


def test_a_small_tag_that_was_found_is_found_again_in_its_place():
    """A window is enlarged, which hides some tags from a finder with thresholds in squares of fixed sizes."""
    found = kept = 0
    for seed in range(120):
        family, picture = small_tag(seed)
        finder = TagFinder((marker(family),))
        if finder.look(picture, 0, {}, everywhere=True):
            found += 1
            kept += bool(finder.look(picture, FRAME_NS, {}, everywhere=False))
    assert found > 60
    assert kept == found
