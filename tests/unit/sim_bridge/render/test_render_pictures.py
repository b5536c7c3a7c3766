"""Rendered pictures: corners at their projections, errors as in the scenario, and reproducible."""

import math
from dataclasses import replace
from typing import Any

import cv2
import numpy as np
import pytest

from drivers.camera.detect import refined
from groundstation.geometry.board import Checkerboard
from groundstation.geometry.lens import CameraIntrinsics
from groundstation.geometry.pose import Pose
from groundstation.geometry.rotations import base_from_tilted_optical
from sim_bridge.fault_kinds import Fault, FaultKind
from sim_bridge.render.process import FrameDelay, active_outage, held_until_s
from sim_bridge.render.renderer import Renderer
from sim_bridge.render.scene import compose_scene
from sim_bridge.render.spec import BoardSpec, BodyShape, Mount, Outage, OutageKind, PictureQuality, RenderSpec
from sim_bridge.render.wrong_pictures import WrongPictures, spec_under

FRONT = CameraIntrinsics(640, 360, 460.0, 460.0, 319.5, 179.5, (-0.30, 0.08, 0.0, 0.0, 0.0))
CEILING = CameraIntrinsics(1280, 720, 1179.0, 1179.0, 639.5, 359.5, (-0.12, 0.05, 0.0, 0.0, 0.0))
MOUNTS = {
    "drone_1": Mount(Pose(base_from_tilted_optical(math.radians(45)), np.array([0.09, 0.0, 0.0])), "drone_1"),
    "ceiling": Mount(Pose(np.diag([1.0, -1.0, -1.0]), np.array([0.0, 0.0, 4.2]))),
}
CLEAN = PictureQuality(corner_noise_px=0.0, pixel_noise=0.0, blur_px=0.5, exposure_ms=0.0)


def make_spec(camera="drone_1", scenario=CLEAN, seed=1):
    boards = (BoardSpec("drone_1", 1, 44.0, (0, 0, 0.08)), BoardSpec("bot", 5, 44.0, (0, 0, 0.4), BodyShape.TURTLEBOT))
    lens = CEILING if camera == "ceiling" else FRONT
    return RenderSpec(camera, MOUNTS[camera], lens, boards, "t", ("drone_1", "bot"), "127.0.0.1", 0, scenario, seed)


def state(x, y, z, yaw=0.0, roll=0.0, pitch=0.0, velocity=(0.0, 0.0, 0.0)):
    return [x, y, z, *velocity, roll, pitch, yaw, 0.0, 0.0, 0.0, 0.0]


def bot_corners(spec, states):
    sight = next(s for s in compose_scene(spec, states).sights if s.board.body == "bot")
    return spec.intrinsics.project(sight.optical_from_marker.apply(Checkerboard(5, 44.0).corners()))


def corner_errors(camera, scenario, poses, seed=0):
    """Return found minus projected corners (n, 12, 2) of the bot's board over random poses."""
    spec = make_spec(camera, scenario)
    renderer, random, errors = Renderer(spec), np.random.default_rng(seed), []
    for _ in range(poses):
        low, high = ([-1.2, -0.6, 0.0], [1.2, 0.6, 1.5]) if camera == "ceiling" else ([0.8, -0.4, 0.3], [1.5, 0.4, 0.8])
        (x, y, z), yaw, (roll, pitch) = random.uniform(low, high), random.uniform(-3, 3), random.normal(0, 0.15, 2)
        bot = state(x, y, z, yaw, roll, pitch)
        states = np.array([state(0, 0, 2.0 if camera == "drone_1" else 9.0), bot])
        truth = bot_corners(spec, states)
        if not spec.intrinsics.contains(truth, 30.0).all():
            continue
        errors.append(refined(renderer.render(states), truth) - truth)
    assert len(errors) >= poses // 3
    return np.array(errors)


@pytest.mark.parametrize("camera", ["drone_1", "ceiling"])
def test_corners_are_where_projection_says(camera):
    errors = corner_errors(camera, CLEAN, 40)
    assert np.abs(errors.mean(axis=(0, 1))).max() <= 0.02
    assert np.sqrt((errors**2).mean()) <= 0.1


@pytest.mark.parametrize("camera", ["drone_1", "ceiling"])
def test_corners_scatter_by_the_scenarios_figure(camera):
    errors = corner_errors(camera, PictureQuality(exposure_ms=0.0), 40)
    assert np.sqrt((errors**2).mean()) == pytest.approx(0.2, abs=0.045)
    assert np.abs(errors.mean(axis=(0, 1))).max() <= 0.05


def test_a_smear_does_not_move_the_corners():
    spec = make_spec("ceiling", PictureQuality(corner_noise_px=0, pixel_noise=0, exposure_ms=8.0))
    renderer = Renderer(spec)
    states = np.array([state(0, 0, 9), state(0.4, 0.3, 0.5, 0.4, velocity=(0.6, 0.3, 0.0))])
    truth = bot_corners(spec, states)
    picture = renderer.render(states)
    guess = truth.astype(np.float32).reshape(-1, 1, 2)
    found = cv2.cornerSubPix(picture, guess, (4, 4), (-1, -1), (3, 40, 1e-3)).reshape(-1, 2)
    assert np.abs((found - truth).mean(axis=0)).max() < 0.05
    still = renderer.render(states * np.where(np.arange(13) // 3 == 1, 0.0, 1.0))
    assert cv2.Laplacian(picture, cv2.CV_64F).var() < cv2.Laplacian(still, cv2.CV_64F).var()


def test_same_seed_same_picture():
    states = np.array([state(0, 0, 2), state(1.6, 0, 0)])
    scenario = PictureQuality()
    first, second = (Renderer(make_spec(scenario=scenario, seed=3)).render(states) for _ in range(2))
    other = Renderer(make_spec(scenario=scenario, seed=4)).render(states)
    assert (first == second).all()
    assert (first != other).any()


def test_all_cameras_of_a_run_stand_on_one_floor():
    one, two = (Renderer(make_spec("ceiling", seed=seed)).render(np.array([state(9, 9, 9)] * 2)) for seed in (1, 2))
    assert np.abs(one.astype(int) - two).mean() > 5.0


def test_a_camera_does_not_see_its_own_carrier():
    spec = make_spec()
    sights = compose_scene(spec, np.array([state(0, 0, 2), state(1, 0, 0)])).sights
    assert [sight.board.body for sight in sights] == ["bot"]


def test_boards_seen_from_below_and_beyond_the_border_are_harmless():
    renderer = Renderer(make_spec(scenario=PictureQuality()))
    random = np.random.default_rng(5)
    for _ in range(40):
        states = np.array(
            [
                state(0, 0, 1, 0, *random.normal(0, 0.5, 2)),
                state(*random.uniform(-2.5, 2.5, 3), *random.normal(0, 2, 3)),
            ]
        )
        assert renderer.render(states).shape == (360, 640)


def test_ceiling_picture_axes():
    """Picture right is world +x, picture up is world +y."""
    spec = make_spec("ceiling")
    centre = bot_corners(spec, np.array([state(0, 0, 9), state(0.8, 0.5, 0)])).mean(axis=0)
    assert centre[0] > 639.5 + 150
    assert centre[1] < 359.5 - 100


def test_link_keeps_order_loses_its_share_and_is_late_by_the_delay():
    link = FrameDelay(make_spec(scenario=PictureQuality(frame_loss=0.05)))
    exposures = [k * 66_000_000 for k in range(3000)]
    pairs = [(e, link.release_ns(e)) for e in exposures]
    delays = np.array([r - e for e, r in pairs if r is not None]) / 1e6
    releases = [r for _, r in pairs if r is not None]
    assert releases == sorted(releases)
    assert 1 - len(releases) / 3000 == pytest.approx(0.05, abs=0.015)
    assert delays.min() >= 100 - 1e-6
    assert delays.max() <= 140 + 1e-6
    assert delays.mean() == pytest.approx(120, abs=1)


def test_outages():
    outages = (Outage(OutageKind.STALL, 2.0, 4.0), Outage(OutageKind.CUT, 3.0))
    assert active_outage(outages, 1.0) is None
    assert active_outage(outages, 2.5) is OutageKind.STALL
    assert active_outage(outages, 3.5) is OutageKind.CUT
    assert active_outage(outages, 1e6) is OutageKind.CUT


def test_pictures_that_are_held_back_come_together_at_the_end_in_their_order():
    outages = (Outage(OutageKind.HELD_BACK, 2.0, 3.0),)
    sure = replace(CLEAN, video_delay_ms=100.0, video_jitter_ms=0.0, frame_loss=0.0)
    link = FrameDelay(make_spec("drone_1", sure))
    releases = []
    for exposed in (1.9, 2.1, 2.6, 2.95, 3.1):
        held_until_ns = round(1e9 * held_until_s(outages, exposed))
        releases.append(link.release_ns(round(exposed * 1e9), held_until_ns))
    assert releases == [pytest.approx(when * 1e9, abs=1e3) for when in (2.0, 3.0, 3.0, 3.05, 3.2)]


def broken(kind, **more):
    given: dict[str, Any] = {"entity": "drone_1", "start_s": 2.0, "end_s": 4.0} | more
    return Fault(kind=FaultKind(kind), **given)


def pictures(*faults, camera="drone_1"):
    return WrongPictures(make_spec(camera, replace(CLEAN, faults=faults)))


STATES = [np.array([state(0, 0, 1.5), state(x, 0.0, 0.0)]) for x in (1.2, 1.4, 1.6)]


def test_a_frozen_picture_repeats_and_a_black_one_shows_nothing():
    frozen, black = pictures(broken("picture_frozen")), pictures(broken("picture_black"))
    shown = [frozen.render(states, t) for states, t in zip(STATES, (1.9, 2.5, 4.0), strict=True)]
    assert (shown[0] == shown[1]).all() and (shown[0] != shown[2]).any()
    assert black.render(STATES[0], 3.0).max() == 0 and black.render(STATES[0], 5.0).max() > 0


def test_a_black_picture_has_the_noise_of_its_sensor():
    spec = make_spec(scenario=PictureQuality(pixel_noise=2.0, faults=(broken("picture_black"),)))
    camera = WrongPictures(spec)
    one, other = (camera.render(STATES[0], t) for t in (2.5, 3.0))
    assert (one != other).any() and 5 < one.max() < 20 and one.mean() < 2.0


def test_in_a_bumped_camera_everything_moves():
    camera = pictures(broken("camera_bumped", value=3.0))
    honest, bumped = (camera.render(STATES[0], t) for t in (1.0, 3.0))
    spec = make_spec()
    truth = bot_corners(spec, STATES[0])
    assert np.abs(refined(honest, truth) - truth).max() < 0.2
    turned = bot_corners(spec_under(spec, [broken("camera_bumped", value=3.0)]), STATES[0])
    assert np.abs(refined(bumped, turned) - turned).max() < 0.2
    shift = (turned - truth).mean(axis=0)
    assert shift[1] == pytest.approx(spec.intrinsics.fy_px * math.radians(3.0), rel=0.2), "it looks higher"


def test_a_wrong_board_is_that_of_the_other():
    swap = broken("wrong_board", entity="bot", other="drone_1", start_s=0.0, end_s=None)
    found = spec_under(make_spec(), [swap]).boards
    assert [(board.body, board.code) for board in found] == [("drone_1", 1), ("bot", 1)]
    assert found[1].position_m == (0, 0, 0.4)
