"""Disturbances of the room: hidden markers, misled sensors, radio bursts, cameras with mounting errors."""

import json
import math
from dataclasses import replace
from typing import Any

import msgspec
import numpy as np
import pytest

from groundstation.field.resolved import ResolvedField
from groundstation.geometry.rotations import euler_from_rotation, world_from_downward_optical
from sim_bridge.cameras import render_specs
from sim_bridge.fault_kinds import FaultKind
from sim_bridge.link_bursts import with_bursts
from sim_bridge.mounting import as_measured, generator_of_eye, mounted, on_drone, true_lens
from sim_bridge.scenario import Scenario, parse_scenario
from sim_bridge.site import Site, parse_site
from sim_bridge.study.camera_model import Eye
from sim_bridge.surroundings import Obstacle
from sim_bridge.world.ardrone import Quadrotor
from sim_bridge.world.obstacles import Box, floor_below
from sim_bridge.world.world import TICK_S, World


@pytest.fixture(scope="module")
def site(lab_field: ResolvedField) -> Site:
    return parse_site(msgspec.to_builtins(lab_field))


def scenario(**data: Any) -> Scenario:
    return parse_scenario(json.dumps(data))


def box(**data: Any) -> Box:
    return Box(Obstacle.model_validate(data), TICK_S, np.random.default_rng(1), (4.0, 3.0))


def test_a_box_hides_what_is_behind_it_and_nothing_else() -> None:
    person = box(size_m=(0.5, 0.5, 1.75), path={"shape": "none", "position_m": (1.0, 0.0)})
    eye = np.array([0.0, 0.0, 1.0])
    assert person.hides(eye, np.array([2.0, 0.0, 0.4]))
    assert not person.hides(eye, np.array([0.7, 0.0, 0.4]))
    assert not person.hides(eye, np.array([2.0, 1.0, 0.4]))
    assert not person.hides(np.array([0.0, 0.0, 4.2]), np.array([0.0, 2.0, 0.4]))
    assert not person.hides(np.array([0.9, 0.0, 4.2]), np.array([0.9, 0.0, 1.9]))


def test_a_person_moves() -> None:
    person = box(path={"shape": "waypoints", "points_m": [[0, 0], [3, 0]], "speed_m_s": 1.2})
    for _ in range(400):
        person.step()
    assert person.body.x > 1.5


@pytest.mark.parametrize(("place", "seen"), [((0.0, 0.0), False), ((1.5, 1.5), True)])
def test_an_obstacle_under_the_ceiling_camera_hides_the_drone(
    site: Site, place: tuple[float, float], seen: bool
) -> None:
    name, drone = next(iter(site.drones.items()))
    told = scenario(obstacles=[{"size_m": [0.6, 0.6, 3.0], "path": {"shape": "none", "position_m": place}}])
    world = World(site, told, 1)
    world.drones[name].airframe.x, world.drones[name].airframe.y = 0.0, 0.0
    camera, mount = next(iter(site.cameras.items()))
    eye = Eye(camera, mount.calibration, mount, site, told.cameras, 0.0, generator_of_eye(1, camera))
    found = {one.subject for _ in range(60) for one in eye.look(world, 0, "clock")}
    assert (name in found) is seen
    assert drone.kind == "ardrone"


def test_a_camera_tells_headings_by_the_mounting_that_the_field_has(lab_field: ResolvedField) -> None:
    """A detector uses the field's mounting only: the camera's rotation error is in each heading and position."""
    values = msgspec.to_builtins(lab_field)
    values["cameras"]["ceiling"]["attitude_std_deg"] = 5.0
    values["drones"]["drone_2"]["camera"]["attitude_std_deg"] = 5.0
    site, told = parse_site(values), scenario(cameras={"corner_noise_px": 0.0})
    world = World(site, told, 1)
    world.drones["drone_1"].airframe.x, world.drones["drone_1"].airframe.y = 0.0, 0.0
    mount = site.cameras["ceiling"]
    eye = Eye("ceiling", mount.calibration, mount, site, told.cameras, 0.0, generator_of_eye(1, "ceiling"))
    (seen, *_) = [one for _ in range(60) for one in eye.look(world, 0, "c") if one.subject == "drone_1"]
    turned = euler_from_rotation(eye.truth[0] @ world_from_downward_optical(mount.rotation_deg).T)[2]
    assert abs(turned) > math.radians(1.0) and seen.yaw_rad is not None
    assert math.remainder(world.drones["drone_1"].airframe.yaw - turned - seen.yaw_rad, math.tau) == pytest.approx(
        0.0, abs=math.radians(0.5)
    )


def test_the_room_of_the_simulation_has_the_obstacles_of_the_field(lab_field: ResolvedField) -> None:
    values = msgspec.to_builtins(lab_field)
    values["room"]["obstacles"] = {"cupboard": {"centre_m": [1.0, -0.5], "size_m": [0.6, 0.4, 1.2]}}
    told = scenario(obstacles=[{"path": {"shape": "none", "position_m": [-2.0, 0.0]}}])
    world = World(parse_site(values), told, 1)
    for _ in range(50):
        world.step()
    person, cupboard = world.obstacles
    assert (person.body.x, cupboard.body.x, cupboard.body.y) == (-2.0, 1.0, -0.5)
    assert cupboard.size_m == (0.6, 0.4, 1.2)
    eye = np.array([1.0, -2.0, 1.5])
    assert cupboard.hides(eye, np.array([1.0, 0.5, 0.4])) and not cupboard.hides(eye, np.array([2.0, 0.5, 0.4]))


def test_a_target_that_stands_anywhere_stands_clear_of_obstacles_and_pads(lab_field: ResolvedField) -> None:
    values = msgspec.to_builtins(lab_field)
    values["room"]["obstacles"] = {"table": {"centre_m": [1.0, 0.0], "size_m": [3.0, 3.0, 0.8]}}
    told = scenario(target={"path": {"shape": "anywhere"}, "departs_after_team_s": None})
    places = set()
    for seed in range(1, 21):
        world = World(parse_site(values), told, seed)
        (target,) = world.targets.values()
        world.step()
        assert all(box.footprint.distance_m(target.x, target.y) >= 0.5 for box in world.obstacles)
        assert all(math.dist((target.x, target.y), drone.pad_m) >= 0.5 for drone in parse_site(values).drones.values())
        places.add((target.x, target.y))
    assert len(places) == 20


def test_a_floor_zone_misleads_the_flow_of_those_above_it(site: Site) -> None:
    zones = [{"x_m": [-10, 10], "y_m": [-10, 10], "flow_bias_m_s": [0.5, 0.0]}]
    readings = []
    for told in (scenario(), scenario(floor_zones=zones)):
        world = World(site, told, 1)
        for drone in world.of(Quadrotor).values():
            drone.autopilot.take_off()
        for _ in range(600):
            world.step()
        readings.append([np.array((one.vx, one.vy)) for one in world.onboard.values()])
    for honest, misled in zip(*readings, strict=True):
        assert np.linalg.norm(misled - honest) == pytest.approx(0.5, abs=1e-9)


def test_an_echo_comes_from_what_stands_below() -> None:
    tops = [(0.0, 0.0, 0.18, 0.4)]
    assert floor_below(0.1, 0.0, 1.1, tops) == 0.4
    assert floor_below(0.3, 0.0, 1.1, tops) == 0.4
    assert floor_below(0.5, 0.0, 1.1, tops) == 0.0
    assert floor_below(0.0, 0.0, 0.3, tops) == 0.0


def test_bursts_silence_one_vehicle_both_ways_and_its_pictures() -> None:
    told = with_bursts(scenario(link_bursts={"per_minute": 6.0, "from_s": 10.0}), ("a", "b"), ("a",), seed=1)
    starts = {name: {f.start_s for f in told.faults if f.entity == name} for name in "ab"}
    assert 60 < len(starts["a"]) < 120
    assert not starts["a"] & starts["b"]
    assert {f.kind for f in told.faults if f.entity == "b"} == {FaultKind.NAVDATA_SILENT, FaultKind.AT_DEAF}
    assert {f.kind for f in told.faults if f.entity == "a"} == {
        FaultKind.NAVDATA_SILENT, FaultKind.AT_DEAF, FaultKind.CAMERA_STALL,
    }  # fmt: skip
    assert min(f.start_s for f in told.faults) >= 10.0
    assert all(f.end_s is not None and 0.2 <= f.end_s - f.start_s <= 1.5 for f in told.faults)
    assert with_bursts(scenario(), ("a",), (), seed=1).faults == ()


def test_rendered_cameras_hang_as_those_of_the_study(site: Site) -> None:
    name, camera = next(iter(site.cameras.items()))
    streams = {name: ("127.0.0.1", 8080)}
    (spec,) = render_specs(site, scenario(), streams, "board", seed=4)
    rotation, place = mounted(camera, True, generator_of_eye(4, name))
    assert np.array_equal(spec.mount.parent_from_optical.rotation, rotation)
    assert np.array_equal(spec.mount.parent_from_optical.translation, place)
    assert 0.0 < np.linalg.norm(place - camera.position_m) < 4 * camera.position_std_m
    (exact,) = render_specs(site, scenario(cameras={"mounting_errors": False}), streams, "board", seed=4)
    assert exact.mount.parent_from_optical.translation == pytest.approx(camera.position_m)


def said(site: Site, **figures: float) -> Site:
    """Return the site with deviations of its first drone's camera; `fx_px` and others are of its lens."""
    values = site.model_dump()
    camera = next(iter(values["drones"].values()))["camera"]
    mounting = {name: figures.pop(name) for name in ("attitude_std_deg", "position_std_m") if name in figures}
    nothing = dict.fromkeys(("fx_px", "fy_px", "cx_px", "cy_px", "k1", "k2", "p1", "p2", "k3"), 0.0)
    camera |= mounting
    camera["calibration"]["std"] = nothing | figures
    return parse_site(values)


def test_rendered_cameras_of_drones_are_off_as_those_of_the_study(site: Site) -> None:
    off = said(site, attitude_std_deg=0.5, position_std_m=0.01, fx_px=3.0, cx_px=2.0)
    name, drone = next(iter(off.drones.items()))
    assert drone.camera is not None
    (spec,) = render_specs(off, scenario(), {name: ("127.0.0.1", 8080)}, "board", seed=4)
    rng = generator_of_eye(4, name)
    rotation, place = on_drone(drone.camera, True, rng)
    assert np.array_equal(spec.mount.parent_from_optical.rotation, rotation)
    assert np.array_equal(spec.mount.parent_from_optical.translation, place)
    assert spec.intrinsics == true_lens(drone.camera.calibration, True, rng)
    assert spec.intrinsics.fx_px != drone.camera.calibration.fx_px
    assert spec.intrinsics.fy_px == drone.camera.calibration.fy_px
    exact = scenario(cameras={"mounting_errors": False})
    (spec,) = render_specs(off, exact, {name: ("127.0.0.1", 8080)}, "board", seed=4)
    assert spec.intrinsics == drone.camera.calibration.intrinsics
    assert spec.mount.parent_from_optical.translation == pytest.approx(drone.camera.position_m)


def test_drawn_mountings_and_lenses_scatter_as_the_field_says(site: Site) -> None:
    off = said(site, attitude_std_deg=0.5, position_std_m=0.01, fx_px=3.0)
    camera = next(iter(off.drones.values())).camera
    assert camera is not None
    known, _ = on_drone(camera, False, np.random.default_rng(0))
    turns, shifts, focals = [], [], []
    for seed in range(300):
        rng = np.random.default_rng(seed)
        rotation, place = on_drone(camera, True, rng)
        turns.append(math.degrees(math.acos(min(1.0, (np.trace(rotation @ known.T) - 1.0) / 2.0))))
        shifts.append(place - camera.position_m)
        focals.append(true_lens(camera.calibration, True, rng).fx_px - camera.calibration.fx_px)
    assert math.sqrt(np.mean(np.square(turns)) / 3.0) == pytest.approx(0.5, rel=0.1)
    assert np.std(shifts) == pytest.approx(0.01, rel=0.1)
    assert np.std(focals) == pytest.approx(3.0, rel=0.1)


def test_a_field_that_says_no_deviations_has_exact_cameras_on_its_drones(site: Site) -> None:
    camera = next(iter(site.drones.values())).camera
    assert camera is not None
    rng, untouched = np.random.default_rng(1), np.random.default_rng(1)
    _, place = on_drone(camera, True, rng)
    assert tuple(place) == camera.position_m
    assert true_lens(camera.calibration, True, rng) == camera.calibration.intrinsics
    assert rng.random() == untouched.random()


def test_a_detector_that_believes_a_wrong_lens_is_off_as_its_pixels_say(site: Site) -> None:
    camera = next(iter(site.drones.values())).camera
    assert camera is not None
    told = camera.calibration.intrinsics
    point = np.array([0.4, -0.2, 1.5])
    assert np.array_equal(as_measured(point, told, told), point)
    true = replace(told, fx_px=1.03 * told.fx_px, fy_px=1.03 * told.fy_px, cx_px=told.cx_px + 5.0)
    found = as_measured(point, true, told)
    assert told.project(found) == pytest.approx(true.project(point))
    assert found[2] == pytest.approx(point[2] / 1.03)
