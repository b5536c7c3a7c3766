"""Boxes of the room in rendered pictures: they hide what the study's boxes hide, and nothing before them."""

import math
import os

import msgspec
import numpy as np
import pytest

from groundstation.arrays import Image
from groundstation.field.resolved import ResolvedField
from groundstation.geometry.lens import CameraIntrinsics
from groundstation.geometry.pose import Pose
from groundstation.geometry.rotations import base_from_tilted_optical
from sim_bridge.cameras import render_specs
from sim_bridge.render.box_painter import BoxPainter
from sim_bridge.render.lens_table import LensTable
from sim_bridge.render.renderer import Renderer
from sim_bridge.render.spec import BoardSpec, BodyShape, BoxSpec, Mount, PictureQuality, RenderSpec
from sim_bridge.scenario import Scenario
from sim_bridge.site import SimulatedObstacle, Site, parse_site
from sim_bridge.stage import Stage
from sim_bridge.surroundings import Obstacle
from sim_bridge.target_paths import Standstill, Waypoints
from sim_bridge.truth import TruthBoard
from sim_bridge.world.obstacles import boxes_of
from sim_bridge.world.world import TICK_S, World

WIDE = CameraIntrinsics(640, 360, 460.0, 460.0, 319.5, 179.5, (-0.30, 0.08, 0.0, 0.0, 0.0))
PILLAR = (0.4, 0.4, 3.0)
CLEAN = PictureQuality(corner_noise_px=0.0, pixel_noise=0.0, blur_px=0.5, exposure_ms=0.0)
BODIES = ("drone_1", "bot", "obstacle 0", "obstacle 1")


def at(x: float, y: float, z: float = 0.0) -> list[float]:
    return [x, y, z, *(0.0,) * 10]


def picture(boxes: tuple[BoxSpec, ...], bot: list[float], *places: list[float]) -> Image:
    """Return what a drone 1.2 m above the origin sees to the front, 35 degrees down."""
    mount = Mount(Pose(base_from_tilted_optical(math.radians(35)), np.zeros(3)), "drone_1")
    boards = (BoardSpec("bot", 5, 44.0, (0, 0, 0.4), BodyShape.TURTLEBOT),)
    spec = RenderSpec("drone_1", mount, WIDE, boards, "t", BODIES, "127.0.0.1", 0, CLEAN, boxes=boxes)
    places = (*places, *(at(50, 50),) * (2 - len(places)))
    return Renderer(spec).render(np.array([at(0, 0, 1.2), bot, *places]))


def test_box_covers_the_pixels_of_the_points_it_hides_and_no_others() -> None:
    """Against the study's own occlusion, for random boxes, poses (some within a hand's breadth) and points."""
    random, table = np.random.default_rng(3), LensTable(WIDE)
    hidden = 0
    for _ in range(60):
        size = random.uniform((0.1, 0.1, 0.2), (1.5, 1.0, 3.0))
        place = np.array([*random.uniform(-1.5, 1.5, 2), 0.0])
        told = Obstacle(size_m=tuple(size), path=Standstill(position_m=tuple(place[:2])))
        (box,) = boxes_of((told,), TICK_S, 1, (4.0, 3.0))
        eye = random.uniform((-2.5, -2.5, 0.4), (2.5, 2.5, 3.5))
        turn = math.atan2(place[1] - eye[1], place[0] - eye[0]) + random.uniform(-0.6, 0.6)
        level = np.array([[math.cos(turn), -math.sin(turn), 0], [math.sin(turn), math.cos(turn), 0], [0, 0, 1]])
        if (np.abs(eye - place - (0, 0, size[2] / 2)) < size / 2).all():
            continue
        pose = Pose(level @ base_from_tilted_optical(random.uniform(0.2, 1.5)), eye)
        cover = BoxPainter(told.size_m, 460.0, 0.5, table).cover(place, pose)
        covered = np.zeros((WIDE.height_px, WIDE.width_px))
        if cover is not None:
            left, top, right, bottom = cover.window
            covered[top:bottom, left:right] = cover.coverage
        for row, column in random.integers((4, 4), (356, 636), (60, 2)):
            ray = WIDE.normalised_from_pixels(np.array([[float(column), float(row)]]))[0]
            far = pose.apply(np.array([*ray, 1.0]) * 30.0)
            around = covered[row - 2 : row + 3, column - 2 : column + 3]
            if around.min() > 0.9 or around.max() < 0.1:  # not at the rim
                assert box.hides(eye, far) == (covered[row, column] > 0.5)
                hidden += box.hides(eye, far)
    assert hidden > 300


def test_target_behind_a_box_is_not_in_the_picture() -> None:
    boxes = (BoxSpec("obstacle 0", PILLAR),)
    behind, alone = picture(boxes, at(1.8, 0.0), at(1.1, 0.0)), picture(boxes, at(50, 50), at(1.1, 0.0))
    assert np.array_equal(behind, alone)


def test_target_before_a_box_is_in_the_picture() -> None:
    boxes = (BoxSpec("obstacle 0", PILLAR),)
    before = picture(boxes, at(0.9, 0.0), at(1.8, 0.0))
    free = picture((), at(0.9, 0.0))
    seen = picture((), at(50, 50)) != free
    assert seen.sum() > 500
    assert np.mean(before[seen] == free[seen]) > 0.9  # all but the soft rim


def test_part_of_a_target_beside_a_box_is_in_the_picture() -> None:
    boxes = (BoxSpec("obstacle 0", PILLAR), BoxSpec("obstacle 1", (0.3, 0.3, 0.2)))
    places = (at(1.0, 0.2), at(0.7, -0.6))
    bare = picture(boxes, at(50, 50), *places)
    hidden, half, free = (np.count_nonzero(picture(boxes, at(1.6, y), *places) != bare) for y in (0.3, 0.05, -0.3))
    assert hidden == 0
    assert 0.2 * free < half < 0.8 * free


def test_camera_that_almost_touches_a_box_sees_nothing_else() -> None:
    boxes = (BoxSpec("obstacle 0", PILLAR),)
    assert np.ptp(picture(boxes, at(1.8, 0.0), at(0.21, 0.0))) <= 1


@pytest.fixture
def surrounded(lab_field: ResolvedField) -> tuple[Site, Scenario]:
    """Return a room with a pillar, and a scenario with a box that drives along."""
    site = parse_site(msgspec.to_builtins(lab_field))
    room = site.room.model_copy(update={"obstacles": {"pillar": SimulatedObstacle(centre_m=(2.0, 2.0), size_m=PILLAR)}})
    trolley = Obstacle(size_m=(0.5, 0.4, 1.0), path=Waypoints(points_m=((-2.0, -2.0), (2.0, -2.0)), speed_m_s=0.5))
    return site.model_copy(update={"room": room}), Scenario(obstacles=(trolley,))


def test_render_processes_are_told_of_all_boxes(surrounded: tuple[Site, Scenario]) -> None:
    site, scenario = surrounded
    name = next(iter(site.cameras))
    (spec,) = render_specs(site, scenario, {name: ("127.0.0.1", 8080)}, "board", 1)
    assert [box.size_m for box in spec.boxes] == [(0.5, 0.4, 1.0), PILLAR]
    assert [spec.bodies.index(box.body) for box in spec.boxes] == [len(site.bodies), len(site.bodies) + 1]


def test_boxes_on_the_truth_board_are_where_the_world_has_them(surrounded: tuple[Site, Scenario]) -> None:
    site, scenario = surrounded
    stage = Stage(World(site, scenario, 1))
    stage.share_truth(name := f"{os.getpid()}-boxes")
    try:
        (spec,) = render_specs(site, scenario, {next(iter(site.cameras)): ("127.0.0.1", 8080)}, name, 1)
        board = TruthBoard.attach(name, spec.bodies)
        rows = []
        for _ in range(2):
            for _ in range(200):
                stage.tick(1)
            rows.append(board.read()[1][-2:])
        board.close()
    finally:
        stage.close()
    (before, _), (trolley, pillar) = rows
    assert pillar.tolist() == [2.0, 2.0, *(0.0,) * 11]
    body = stage.world.obstacles[0].body
    assert trolley.tolist() == [body.x, body.y, *(0.0,) * 11]
    assert 0.2 < math.dist(trolley[:2], before[:2]) < 0.6
