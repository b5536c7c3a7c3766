"""Search windows from the belief: about the truth, none where nothing can be, and no identity from the belief."""

import math

import numpy as np
import pytest

from drivers.camera import pose
from drivers.camera.convert import stabilized_from_optical
from drivers.camera.pipeline import Pipeline
from drivers.camera.prediction import Foresight
from drivers.camera.settings import DetectorSettings, MarkerKind, MarkerSettings, MountSettings
from groundstation.bus.messages import EntityEstimate, Estimate, Header, TargetSearch
from groundstation.geometry.board import Checkerboard
from groundstation.geometry.lens import CameraIntrinsics
from groundstation.geometry.pose import Pose
from groundstation.geometry.rotations import base_from_tilted_optical
from sim_bridge.render.renderer import Renderer
from sim_bridge.render.scene import compose_scene
from sim_bridge.render.spec import BoardSpec, BodyShape, Mount, PictureQuality, RenderSpec

FRONT = CameraIntrinsics(640, 360, 460.0, 460.0, 319.5, 179.5, (-0.30, 0.08, 0.0, 0.0, 0.0))
MOUNT = MountSettings(parent="drone_1", position_m=(0.09, 0.0, 0.0), tilt_down_deg=45.0)
MARKERS = (
    MarkerSettings(entity="drone_2", code=2, square_mm=44.0, position_m=(0.0, 0.0, 0.08)),
    MarkerSettings(entity="bot", code=5, square_mm=44.0, position_m=(0.0, 0.0, 0.4), kind=MarkerKind.TARGET),
)
FRAME_NS = 66_666_667
SCENARIO = PictureQuality(exposure_ms=0.0)


def renderer_of(codes=(2, 5), square_mm=44.0, scenario=SCENARIO):
    mount = Mount(Pose(base_from_tilted_optical(math.radians(45)), np.array(MOUNT.position_m)), "drone_1")
    boards = (
        BoardSpec("drone_2", codes[0], square_mm, (0.0, 0.0, 0.08)),
        BoardSpec("bot", codes[1], square_mm, (0.0, 0.0, 0.4), BodyShape.TURTLEBOT),
    )
    bodies = ("drone_1", "drone_2", "bot")
    return Renderer(RenderSpec("drone_1", mount, FRONT, boards, "t", bodies, "127.0.0.1", 0, scenario))


def state(x, y, z, yaw=0.0, roll=0.0, pitch=0.0):
    return [x, y, z, 0.0, 0.0, 0.0, roll, pitch, yaw, 0.0, 0.0, 0.0, 0.0]


def robot(name, row, std=0.03, velocity=(0.0, 0.0, 0.0)):
    covariance = np.diag([std, std, std, 0.03]) ** 2
    mean = (row[0], row[1], row[2], row[8])
    return EntityEstimate(name, "robot", mean, tuple(covariance.ravel()), velocity, True, 0.1)


def target(name, row, std=0.05, velocity=(0.0, 0.0)):
    return EntityEstimate(name, "target", (row[0], row[1]), (std**2, 0.0, 0.0, std**2), velocity, True, 0.1)


def estimate(stamp_ns, *entities):
    return Estimate(header=Header(stamp_ns, "c", "tracker", "tracker", 1), entities=entities, epoch=1)


def belief(states, stamp_ns=0, std=0.03):
    return estimate(
        stamp_ns, robot("drone_1", states[0], std), robot("drone_2", states[1], std), target("bot", states[2], std)
    )


def foresight(mount=MOUNT, observer="drone_1", lens=FRONT):
    return Foresight(mount, observer, MARKERS, lens)


def gravity_of(states):
    rotation = stabilized_from_optical(MOUNT, states[0][6], states[0][7])
    return lambda entity: pose.Gravity(rotation, 0.0, 0.0, known=True)


def true_corners(renderer, states, body):
    sight = next(s for s in compose_scene(renderer._spec, np.array(states)).sights if s.board.body == body)
    return FRONT.project(sight.optical_from_marker.apply(Checkerboard(5, 44.0).corners()))


SCENE = [state(0.2, -0.1, 2.0, 0.5, 0.05, -0.08), state(1.6, 1.2, 0.5, 2.0), state(1.7, 0.5, 0.0, -1.0)]


def test_windows_hold_the_markers():
    eyes, renderer = foresight(), renderer_of()
    eyes.add(belief(SCENE))
    predictions = eyes.at(0, (0.05, -0.08))
    for body in ("drone_2", "bot"):
        corners = true_corners(renderer, SCENE, body)
        assert predictions[body].centre == pytest.approx(corners.mean(axis=0), abs=2.0)
        window = predictions[body].window((360, 640))
        assert window.left <= corners[:, 0].min() - 4
        assert window.right >= corners[:, 0].max() + 4
        assert window.right - window.left < 320


def test_an_uncertain_belief_opens_the_window_and_a_useless_one_closes_it():
    widths = []
    for std in (0.01, 0.1, 0.2):
        eyes = foresight()
        eyes.add(belief(SCENE, std=std))
        widths.append(eyes.at(0, (0.05, -0.08))["bot"].std_px)
    assert widths == sorted(widths)
    eyes = foresight()
    eyes.add(belief(SCENE, std=1.5))
    assert "bot" not in eyes.at(0, (0.05, -0.08))


def test_velocities_carry_the_window_to_the_exposure():
    moving = estimate(
        0, robot("drone_1", SCENE[0]), robot("drone_2", SCENE[1]), target("bot", SCENE[2], velocity=(0.0, 1.0))
    )
    eyes, later = foresight(), [*SCENE[:2], state(1.7, 0.6, 0.0)]
    eyes.add(moving)
    wanted = true_corners(renderer_of(), later, "bot").mean(axis=0)
    assert eyes.at(100_000_000, (0.05, -0.08))["bot"].centre == pytest.approx(wanted, abs=2.5)


def test_the_estimate_nearest_to_the_exposure_counts_and_old_ones_do_not():
    eyes = foresight()
    eyes.add(belief(SCENE, 0))
    eyes.add(belief([SCENE[0], SCENE[1], state(1.2, -0.4, 0.0)], 200_000_000))
    early, late = (eyes.at(stamp, (0.05, -0.08))["bot"].centre for stamp in (20_000_000, 180_000_000))
    assert np.hypot(*(early - late)) > 50
    assert eyes.at(600_000_000, None) == {}


def test_markers_behind_the_camera_or_turned_away_are_not_in_view():
    eyes = foresight()
    behind = [state(0, 0, 2.0), state(-3.0, 0.0, 1.0), state(-2.0, 0.0, 0.0)]
    eyes.add(belief(behind))
    assert eyes.at(0, (0.0, 0.0)) == {"drone_2": None, "bot": None}
    above = [state(0, 0, 1.0), state(0.8, 0.0, 1.3), SCENE[2]]
    eyes = foresight()
    eyes.add(belief(above))
    assert eyes.at(0, (0.0, 0.0))["drone_2"] is None


def test_an_observer_without_a_belief_expects_nothing():
    eyes = foresight()
    eyes.add(estimate(0, target("bot", SCENE[2])))
    assert eyes.at(0, (0.0, 0.0)) == {}


def test_a_camera_fixed_in_the_world_expects_robots():
    mount = MountSettings(parent="world", position_m=(0.0, 0.0, 4.2), looking="down")
    lens = CameraIntrinsics(1280, 720, 1179.0, 1179.0, 639.5, 359.5)
    eyes = Foresight(mount, "ceiling", MARKERS[:1], lens)
    eyes.add(estimate(0, robot("drone_2", state(1.0, 0.5, 1.12))))
    # By hand: the marker is at z = 1.2, 3 m below; 1179 * 1.0 / 3 = 393 px to the right, 196.5 px up.
    expected = eyes.at(0, (0.0, 0.0))["drone_2"]
    assert expected is not None
    assert expected.centre == pytest.approx([639.5 + 393, 359.5 - 196.5], abs=0.5)


def test_boards_are_found_at_once_where_the_belief_has_them():
    """No full search has run yet: the windows from the belief find both boards in the first pictures."""
    renderer, eyes = renderer_of(), foresight()
    pipeline = Pipeline(FRONT, MARKERS, DetectorSettings(), search_rate_hz=2.0, search_phase_s=10.0)
    for k in range(2):
        eyes.add(belief(SCENE, k * FRAME_NS))
        picture = renderer.render(np.array(SCENE))
        seen = pipeline.process(picture, k * FRAME_NS, gravity_of(SCENE), eyes.at(k * FRAME_NS, (0.05, -0.08)))
    assert {sighting.entity for sighting in seen} == {"drone_2", "bot"}
    assert pipeline.counts["searches"] == 0


def test_the_belief_follows_a_camera_that_turns_fast():
    """The carrier yaws at 100 deg/s back and forth: at constant image velocity boards would be lost at each turn."""
    renderer, eyes = renderer_of(), foresight()
    pipeline = Pipeline(FRONT, MARKERS, DetectorSettings(), search_rate_hz=2.0, search_phase_s=10.0)
    seen = 0
    for k in range(30):
        yaw = 0.25 + 0.28 * math.sin(1.75 * 2 * math.pi * k / 15 + 0.4)
        states = [state(0.0, 0.0, 2.0, yaw), state(9, 9, 1), state(1.7, 0.5, 0.0)]
        eyes.add(belief(states, k * FRAME_NS))
        picture = renderer.render(np.array(states))
        out = pipeline.process(picture, k * FRAME_NS, gravity_of(states), eyes.at(k * FRAME_NS, (0.0, 0.0)))
        seen += any(sighting.entity == "bot" for sighting in out)
    assert seen >= 27


def unseen(stamp_ns, age_s, search="", mode="SEARCH"):
    """Return an estimate whose target no camera has seen for this time, or that is searched for."""
    bot = EntityEstimate("bot", "target", (9.0, 9.0), (0.01, 0.0, 0.0, 0.01), (0.0, 0.0), True, age_s)
    away = EntityEstimate(
        "drone_2", "robot", (9.0, 9.0, 1.0, 0.0), tuple((0.01 * np.eye(4)).ravel()), (0.0,) * 3, True, 5
    )
    searches = (TargetSearch(search, mode, 1.0, (0.0, 0.0), 0.1, None, ""),) if search else ()
    entities = (robot("drone_1", SCENE[0]), away, *(() if search else (bot,)))
    return Estimate(
        header=Header(stamp_ns, "c", "tracker", "tracker", 1), entities=entities, epoch=1, searches=searches
    )


@pytest.mark.parametrize(
    ("told", "sought"),
    [
        (unseen(0, 0.3), ()),
        (unseen(0, 0.8), ("bot",)),
        (unseen(0, 60.0), ()),  # no drone can search, or the tracker would report it
        (unseen(0, 0.0, "bot"), ("bot",)),
        (unseen(0, 0.0, "bot", "LOST"), ("bot",)),
        (unseen(0, 0.0, "somebody"), ()),
        (unseen(-400_000_000, 0.8), ()),  # too old to be used
    ],
)
def test_targets_that_no_camera_sees_are_sought(told, sought):
    eyes = foresight()
    assert eyes.sought(0, {}) == frozenset()
    eyes.add(told)
    assert eyes.sought(0, eyes.at(0, (0.0, 0.0))) == frozenset(sought)


@pytest.mark.parametrize(("fixed", "sought"), [(True, {"drone_2"}), (False, set())])
def test_robots_that_a_fixed_camera_should_see_are_sought(fixed, sought):
    """Repeated misses show the tracker that it is not at its believed place; drones miss each other all day."""
    mount = MountSettings(position_m=(0.0, 0.0, 4.2), looking="down") if fixed else MOUNT
    eyes = Foresight(mount, "ceiling" if fixed else "drone_1", MARKERS, FRONT)
    place = state(0.0, 0.0, 1.3) if fixed else state(1.5, 0.0, 0.5)
    seen = EntityEstimate("bot", "target", (0.5, 0.5), (0.01, 0.0, 0.0, 0.01), (0.0, 0.0), True, 0.1)
    eyes.add(estimate(0, robot("drone_1", SCENE[0]), robot("drone_2", place), seen))
    predictions = eyes.at(0, (0.0, 0.0))
    assert predictions["drone_2"] is not None
    assert eyes.sought(0, predictions) == sought


def test_a_target_that_no_camera_sees_is_found_though_the_belief_has_it_elsewhere():
    """It was carried before this camera, which would search whole pictures twice a second."""
    renderer = renderer_of()
    found: dict[tuple[str, ...], int] = {}
    for sought in ((), ("bot",)):
        eyes, pipeline = foresight(), Pipeline(FRONT, MARKERS, DetectorSettings(), search_rate_hz=2.0)
        for k in range(12):
            stamp_ns = k * FRAME_NS
            states = np.array([SCENE[0], state(9, 9, 1), SCENE[2] if k >= 2 else state(9, 9, 0)])
            eyes.add(unseen(stamp_ns, 0.1))
            expected = eyes.at(stamp_ns, (0.05, -0.08))
            seen = pipeline.process(renderer.render(states), stamp_ns, gravity_of(SCENE), expected, sought=sought)
            if any(sighting.entity == "bot" for sighting in seen):
                found.setdefault(sought, k)
        assert expected == {"drone_2": None, "bot": None}
    assert found[("bot",)] <= 4
    assert found[()] >= 7


def test_an_identity_is_read_and_never_taken_from_the_belief():
    renderer, eyes = renderer_of(codes=(2, 9)), foresight()
    pipeline = Pipeline(FRONT, MARKERS, DetectorSettings(), search_rate_hz=2.0)
    for k in range(6):
        eyes.add(belief(SCENE, k * FRAME_NS))
        picture = renderer.render(np.array(SCENE))
        seen = pipeline.process(picture, k * FRAME_NS, gravity_of(SCENE), eyes.at(k * FRAME_NS, (0.05, -0.08)))
        assert "bot" not in {sighting.entity for sighting in seen}


def test_two_boards_with_one_code_are_one_ambiguous_sighting_while_the_belief_lives():
    renderer, eyes = renderer_of(codes=(5, 5)), foresight()
    pipeline = Pipeline(FRONT, MARKERS, DetectorSettings(), search_rate_hz=2.0)
    for k in range(12):
        eyes.add(estimate(k * FRAME_NS, robot("drone_1", SCENE[0]), target("bot", SCENE[2])))
        picture = renderer.render(np.array(SCENE))
        seen = pipeline.process(picture, k * FRAME_NS, gravity_of(SCENE), eyes.at(k * FRAME_NS, (0.05, -0.08)))
    (sighting,) = seen
    truth = {
        s.board.body: s.optical_from_marker.translation for s in compose_scene(renderer._spec, np.array(SCENE)).sights
    }
    assert sighting.choice.best.position_m == pytest.approx(truth["bot"], abs=0.03)
    assert sighting.choice.alternative is not None
    assert sighting.choice.alternative.position_m == pytest.approx(truth["drone_2"], abs=0.03)
    (notice,) = pipeline.take_notices()
    assert "identity of bot" in notice.text
    assert pipeline.take_notices() == []


def test_a_mirrored_print_is_refused_by_name():
    states = [state(0.0, 0.0, 1.6), state(9, 9, 1), state(1.2, 0.0, 0.0, 0.6)]
    pipeline = Pipeline(FRONT, MARKERS, DetectorSettings(), search_rate_hz=2.0)
    picture = np.ascontiguousarray(renderer_of().render(np.array(states))[:, ::-1])
    lens = CameraIntrinsics(640, 360, 460.0, 460.0, 319.5, 179.5, FRONT.distortion)
    pipeline = Pipeline(lens, MARKERS, DetectorSettings(), search_rate_hz=2.0)
    for k in range(20):
        assert pipeline.process(picture, k * FRAME_NS, gravity_of(states)) == []
    assert "mirrored" in pipeline.take_notices()[0].text


@pytest.mark.parametrize(("others", "told"), [((), True), ((9,), False)])
def test_a_marker_that_the_field_gives_to_nobody_is_named(others, told):
    states = [state(0.0, 0.0, 1.6), state(1.0, 0.3, 0.9), state(1.2, -0.4, 0.0, 0.6)]
    known = tuple(MARKERS[0].model_copy(update={"entity": "another", "code": code}) for code in others)
    pipeline = Pipeline(FRONT, MARKERS, DetectorSettings(), search_rate_hz=2.0, others=known)
    picture = renderer_of(codes=(2, 9)).render(np.array(states))
    for k in range(75):
        pipeline.process(picture, k * FRAME_NS, gravity_of(states))
    texts = [f"{notice.text}: {notice.remedy}" for notice in pipeline.take_notices()]
    assert len(texts) == told
    if told:
        assert texts[0].startswith("marker 9 is in view, which the field gives to nobody: if it is that of bot (")
        assert "drone_2" not in texts[0]


@pytest.mark.parametrize(("square_mm", "told"), [(44.0, False), (36.0, True)])
def test_a_print_of_the_wrong_size_is_noticed_by_its_heights(square_mm, told):
    renderer = renderer_of(square_mm=square_mm)
    pipeline = Pipeline(FRONT, MARKERS, DetectorSettings(), search_rate_hz=2.0)
    for k in range(60):
        states = [state(0.0, 0.0, 1.8), state(9, 9, 1), state(1.2, 0.2 * math.sin(k / 9), 0.0, 0.6)]
        picture = renderer.render(np.array(states))
        pipeline.process(picture, k * FRAME_NS, gravity_of(states), drop_of=lambda entity: 1.8 - 0.4)
    texts = [f"{notice.text}: {notice.remedy}" for notice in pipeline.take_notices()]
    assert len(texts) == told
    if told:
        assert "marker 5 of bot seems 1.2" in texts[0]
        assert "44 mm are set, 36 mm would fit" in texts[0]
