"""The camera driver's loop with a fake source and a memory bus: its messages about bad or absent pictures."""

import json
import math
from dataclasses import dataclass

import cv2
import numpy as np
import pytest
from fake_camera import SECTION, FakeChild, FakeSource, settings

from drivers.camera import driver
from drivers.camera.sources.frames import Unit
from groundstation.bus import clock
from groundstation.bus.api import Subscription
from groundstation.bus.memory_bus import MemoryBus, MemoryExchange
from groundstation.bus.messages import EntityEstimate, Estimate, Odometry
from groundstation.bus.topics import CAMERA_STATUS, ESTIMATE, IMAGE, OBSERVATION, ODOMETRY, SEARCHED_PICTURE, VIDEO
from groundstation.errors import SettingsError
from groundstation.geometry.lens import CameraIntrinsics
from groundstation.geometry.pose import Pose
from groundstation.geometry.rotations import base_from_tilted_optical
from groundstation.time_units import NS_PER_S
from sim_bridge.render.renderer import Renderer
from sim_bridge.render.spec import BoardSpec, BodyShape, Mount, PictureQuality, RenderSpec


@dataclass
class Rig:
    """The driver between a source and a subscriber."""

    camera: driver.CameraDriver
    child: FakeChild
    source: FakeSource
    bus: MemoryBus
    heard: Subscription


@pytest.fixture
def rig():
    exchange = MemoryExchange()
    child, source = FakeChild(MemoryBus(exchange, "lab", "drone_1_camera")), FakeSource()
    listener = MemoryBus(exchange, "lab", "test")
    subscription = listener.subscribe([OBSERVATION, SEARCHED_PICTURE, CAMERA_STATUS, IMAGE, VIDEO])
    return Rig(driver.CameraDriver(child, settings(), source), child, source, listener, subscription)


@pytest.fixture(scope="module")
def jpeg():
    lens = CameraIntrinsics(640, 360, 460.0, 460.0, 319.5, 179.5, (-0.30, 0.08, 0.0, 0.0, 0.0))
    mount = Mount(Pose(base_from_tilted_optical(math.radians(45)), np.array([0.09, 0.0, 0.0])), "drone_1")
    boards = (BoardSpec("bot", 5, 44.0, (0, 0, 0.4), BodyShape.TURTLEBOT),)
    spec = RenderSpec("c", mount, lens, boards, "t", ("drone_1", "bot"), "127.0.0.1", 0, PictureQuality(exposure_ms=0))
    states = np.zeros((2, 13))
    states[0, 2], states[0, 6], states[1, 0], states[1, 8] = 1.8, 0.1, 1.4, 0.5
    return encoded(Renderer(spec).render(states))


def encoded(picture):
    return cv2.imencode(".jpg", picture)[1].tobytes()


def spend(rig, seconds):
    end_ns = clock.now_ns() + round(seconds * 1e9)
    while clock.now_ns() < end_ns:
        rig.camera.turn()


def odometry(rig, stamp_ns, roll_rad=0.1):
    return Odometry(
        header=rig.bus.header("drone_1", stamp_ns),
        velocity_m_s=(0.0, 0.0, 0.0),
        velocity_covariance=(0.0,) * 9,
        yaw_rad=0.3,
        roll_rad=roll_rad,
        pitch_rad=0.0,
    )


def test_an_observation_carries_exposure_time_attitude_and_names(rig, jpeg):
    now_ns = clock.now_ns()
    rig.bus.publish(ODOMETRY, odometry(rig, now_ns - 120_000_000))
    rig.source.push(jpeg, now_ns)
    rig.camera.turn()
    heard = rig.heard.drain()
    (observation,) = [r.message for r in heard if r.key.topic is OBSERVATION]
    assert observation.header.stamp_ns == now_ns - 120_000_000
    named = (observation.header.entity, observation.observer, observation.subject, observation.camera)
    assert named == ("drone_1", "drone_1", "bot", "drone_1_camera")
    assert observation.roll_rad == pytest.approx(0.1)
    assert observation.yaw_rad == pytest.approx(0.5, abs=0.02)
    assert (len(observation.covariance), observation.margin > 1.0) == (16, True)
    assert [r.message.found for r in heard if r.key.topic is SEARCHED_PICTURE] == [("bot",)]
    (image,) = [r for r in heard if r.key.topic is IMAGE]
    assert (image.payload, image.header.entity, image.header.stamp_ns) == (jpeg, "drone_1_camera", now_ns - 120_000_000)
    assert rig.child.states[0][0] == "READY"


def test_the_attitude_is_that_of_the_exposure_however_late_pictures_come(rig, jpeg):
    now_ns = clock.now_ns()
    camera = driver.CameraDriver(rig.child, settings(video_delay_ms=900), rig.source)
    for k in range(120):
        rig.bus.publish(ODOMETRY, odometry(rig, now_ns - (119 - k) * 10_000_000, 0.1 if k < 40 else 0.0))
        camera._surroundings.read()
    rig.source.push(jpeg, now_ns)
    camera.turn()
    (seen,) = [r.message for r in rig.heard.drain() if r.key.topic is OBSERVATION]
    assert seen.roll_rad == pytest.approx(0.1)


def test_an_unknown_attitude_is_level_with_a_wide_deviation(rig, jpeg):
    """The place is off by 0.2 m where the drone leans by 6 degrees; its deviation must say so."""
    now_ns = clock.now_ns()
    rig.source.push(jpeg, now_ns)
    rig.camera.turn()
    rig.bus.publish(ODOMETRY, odometry(rig, now_ns))
    rig.source.push(jpeg, now_ns + 100_000_000)
    rig.camera.turn()
    unknown, known = [r.message for r in rig.heard.drain() if r.key.topic is OBSERVATION]
    assert (unknown.roll_rad, known.roll_rad) == (0.0, pytest.approx(0.1))
    added = (np.array(unknown.covariance) - np.array(known.covariance)).reshape(4, 4)
    line = np.array(known.position_m)
    across = np.linalg.eigvalsh(added[:3, :3])
    assert across[0] == pytest.approx(0.0, abs=1e-4)  # a tilt changes no distance
    assert line @ added[:3, :3] @ line == pytest.approx(0.0, abs=1e-3)
    assert math.sqrt(across[2]) == pytest.approx(math.radians(8.0) * np.linalg.norm(line), rel=0.05)


@pytest.mark.parametrize(("told", "searches"), [(None, 4), (0.1, 4), (0.8, 15)])
def test_a_driver_that_hears_of_a_target_that_nobody_sees_searches_often(rig, told, searches):
    """Every second picture; without that information twice a second, for there is nothing in view."""
    start_ns = clock.now_ns()
    for k in range(30):
        floor = encoded(np.tile(np.linspace(60 + k, 160 + k, 640), (360, 1)).astype(np.uint8))
        came_ns = start_ns + k * 66_666_667
        if told is not None:
            bot = EntityEstimate("bot", "target", (-3.0, 0.0), (0.01, 0.0, 0.0, 0.01), (0.0, 0.0), True, told)
            header = rig.bus.header("team", came_ns - 120_000_000)
            rig.bus.publish(ESTIMATE, Estimate(header=header, entities=(bot,), epoch=1))
        rig.source.push(floor, came_ns)
        rig.camera.turn()
    assert sum(r.key.topic is SEARCHED_PICTURE for r in rig.heard.drain()) == pytest.approx(searches, abs=1)


def test_a_marker_is_as_old_as_the_row_that_shows_it(rig, jpeg):
    rig.source.push(jpeg, now_ns := clock.now_ns())
    driver.CameraDriver(rig.child, settings(readout_ms=30.0), rig.source).turn()
    (seen,) = [r.message for r in rig.heard.drain() if r.key.topic is OBSERVATION]
    assert 1e6 < abs(seen.header.stamp_ns - now_ns + 120_000_000) < 15e6


def test_a_picture_that_hangs_is_one_picture_and_is_told(rig, jpeg):
    """Its observations carry its first exposure, whatever the detector finds; it proves nobody's absence."""
    start_ns = clock.now_ns() - 4 * NS_PER_S
    for k in range(50):
        rig.source.push(jpeg, start_ns + k * 66_666_667)
        rig.camera.turn()
    heard = rig.heard.drain()
    pictures = [r.message.picture_ns for r in heard if r.key.topic is OBSERVATION]
    assert (len(pictures), set(pictures)) == (50, {start_ns - 120_000_000})
    assert sum(r.key.topic is SEARCHED_PICTURE for r in heard) == 1
    until_ns = clock.now_ns() + NS_PER_S
    while clock.now_ns() < until_ns:
        rig.source.push(jpeg, clock.now_ns())
        rig.camera.turn()
    assert "does not change" in "".join(r.message.detail for r in rig.heard.drain() if r.key.topic is CAMERA_STATUS)


def test_pictures_that_differ_in_one_corner_are_different_pictures(rig, jpeg):
    picture, start_ns = np.asarray(cv2.imdecode(np.frombuffer(jpeg, np.uint8), cv2.IMREAD_GRAYSCALE)), clock.now_ns()
    for k in range(5):
        picture[:8, :8] = 40 * k
        rig.source.push(encoded(picture), start_ns + k * 66_666_667)
        rig.camera.turn()
    pictures = [r.message.picture_ns for r in rig.heard.drain() if r.key.topic is OBSERVATION]
    assert pictures == [start_ns - 120_000_000 + k * 66_666_667 for k in range(5)]


def test_pictures_are_passed_on_at_most_five_times_a_second(rig, jpeg):
    start_ns = clock.now_ns()
    for k in range(16):
        rig.source.push(jpeg, start_ns + k * 66_000_000)
        rig.camera.turn()
    assert sum(r.key.topic is IMAGE for r in rig.heard.drain()) in (5, 6)


def test_garbage_is_counted_and_never_published(rig, jpeg):
    for data in (b"", b"\xff\xd8\xff\xd9", b"\xff\xd8" + b"\x00" * 500, jpeg[: len(jpeg) // 2], jpeg[:-2]):
        rig.source.push(data)
        rig.camera.turn()
    assert rig.camera.counts["jpeg"] == 5
    assert rig.heard.drain() == []
    rig.source.push(jpeg)
    rig.camera.turn()
    assert any(r.key.topic is OBSERVATION for r in rig.heard.drain())


def test_video_is_passed_on_whole_as_received_and_shown_as_jpegs(rig, jpeg):
    pixels = cv2.imdecode(np.frombuffer(jpeg, np.uint8), cv2.IMREAD_GRAYSCALE)
    start_ns = clock.now_ns()
    for k in range(16):
        came_ns = start_ns + k * 66_000_000
        rig.source.push_decoded(pixels, Unit(b"unit %d" % k, came_ns, came_ns - 5_000_000, starts=k == 0))
        rig.camera.turn()
    heard = rig.heard.drain()
    video = [r for r in heard if r.key.topic is VIDEO]
    assert [r.payload for r in video] == [b"unit %d" % k for k in range(16)]
    assert video[3].header.stamp_ns == start_ns + 3 * 66_000_000 - 125_000_000
    images = [r for r in heard if r.key.topic is IMAGE]
    assert len(images) in (5, 6) and images[0].payload.startswith(b"\xff\xd8")
    assert images[0].header.stamp_ns == video[0].header.stamp_ns
    observations = [r.message for r in heard if r.key.topic is OBSERVATION]
    assert observations and observations[0].header.stamp_ns == video[0].header.stamp_ns


def test_a_picture_that_comes_before_its_usual_time_was_not_exposed_in_the_future(rig, jpeg):
    rig.camera._delay_ns = 0
    now_ns = clock.now_ns()
    rig.source.push_decoded(np.zeros((360, 640), np.uint8), Unit(b"x", now_ns, now_ns + 30_000_000))
    rig.camera.turn()
    (video,) = [r for r in rig.heard.drain() if r.key.topic is VIDEO]
    assert video.header.stamp_ns == now_ns


def test_nothing_is_passed_on_where_no_pictures_are_wanted(rig, jpeg):
    rig.source.push_decoded(np.zeros((360, 640), np.uint8), Unit(b"x", clock.now_ns(), clock.now_ns()))
    driver.CameraDriver(rig.child, settings(image_fps=0), rig.source).turn()
    assert not [r for r in rig.heard.drain() if r.key.topic in (IMAGE, VIDEO)]


def test_a_picture_that_claims_to_be_huge_is_refused_unread(rig, jpeg, monkeypatch):
    place = jpeg.index(b"\xff\xc0")
    huge = jpeg[: place + 5] + b"\xff\xff\xff\xff" + jpeg[place + 9 :]
    monkeypatch.setattr(cv2, "imdecode", lambda *_: pytest.fail("decoded"))
    rig.source.push(huge)
    rig.camera.turn()
    assert rig.camera.counts["size"] == 1
    assert "65535x65535" in rig.child.events[0][1]


def test_another_picture_size_is_refused_by_name(rig):
    for _ in range(3):
        rig.source.push(encoded(np.full((240, 320), 128, np.uint8)))
        rig.camera.turn()
    assert rig.camera.counts["size"] == 3
    assert [e for e in rig.child.events if "320x240" in e[1] and "640x360" in e[1]] == rig.child.events
    assert len(rig.child.events) == 1
    assert rig.child.states[-1][0] == "DEGRADED"
    assert not any(r.key.topic is OBSERVATION for r in rig.heard.drain())


def test_a_stall_is_named_once_and_ends_by_itself(rig, jpeg):
    rig.source.push(jpeg)
    rig.camera.turn()
    spend(rig, 0.15)
    assert rig.child.states[-1] == ("DEGRADED", "no picture for 0.05 s (connected, but nothing comes)")
    assert [e[0] for e in rig.child.events] == ["INFO", "WARNING"]
    assert "drone_1_camera" in rig.child.events[-1][1]
    assert "127.0.0.1:9" in rig.child.events[-1][2]
    rig.source.push(jpeg)
    rig.camera.turn()
    assert ("READY", "pictures from http://127.0.0.1:9/video.mjpg") in rig.child.states[2:]


def test_a_camera_that_never_answers_is_named(rig):
    rig.source.connected, rig.source.detail = False, "127.0.0.1:9: Connection refused"
    spend(rig, 0.1)
    assert rig.child.states == [("DEGRADED", "no picture for 0.05 s (127.0.0.1:9: Connection refused)")]


def test_status_tells_connection_age_and_skipped_frames(rig, jpeg):
    rig.source.received = 4
    rig.source.rejected["multipart"] = 2
    rig.source.push(b"no picture")
    rig.camera.turn()
    rig.source.push(jpeg)
    rig.camera.turn()
    spend(rig, 0.55)
    status = [r.message for r in rig.heard.drain() if r.key.topic is CAMERA_STATUS][-1]
    assert not status.connected
    assert (status.frames, status.skipped, status.detections) == (1, 4, 1)
    assert status.age_ms > 500
    assert status.rejected == {"multipart": 2, "jpeg": 1}


def test_a_detector_that_fails_does_not_end_the_process(rig, jpeg, monkeypatch):
    def fail(*_arguments):
        raise cv2.error("singular")

    monkeypatch.setattr(rig.camera._pipeline, "process", fail)
    rig.source.push(jpeg)
    rig.camera.turn()
    assert rig.camera.counts["detector"] == 1


@pytest.mark.parametrize(
    ("change", "named"),
    [
        ({"video_delay_ms": -1}, "video_delay_ms"),
        ({"search_rate_hz": 5}, "search_rate_hz"),
        ({"image_fps": 9}, "image_fps"),
        ({"unheard": 1}, "unheard"),
        ({"mount": {"parent": "world"}}, "looking"),
        ({"markers": [dict(SECTION["markers"][0]), {**SECTION["markers"][1], "code": 1}]}, "share a code"),
    ],
)
def test_wrong_sections_are_named(change, named):
    child = FakeChild(None, json.dumps({**SECTION, **change}))
    with pytest.raises(SettingsError, match=named):
        driver.run(child)


def test_expected_markers_follow_from_mount_and_observed_entities():
    ceiling = {"name": "ceiling", "mount": {"parent": "world", "looking": "down"}}
    assert [m.entity for m in settings().expected_markers] == ["bot"]
    assert [m.entity for m in settings(**ceiling).expected_markers] == ["drone_1"]
    both = settings(**ceiling, observes=["bot", "drone_1"])
    assert [m.entity for m in both.expected_markers] == ["drone_1", "bot"]
    assert (settings().observer, both.observer) == ("drone_1", "ceiling")
