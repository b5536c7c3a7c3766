"""Poses of ROS 2 topics as frames: their dates, and how certain they are."""

from types import SimpleNamespace
from typing import Any

import pytest

from drivers.motion_capture import ros2_source
from drivers.motion_capture.ros2_source import Ros2Source
from drivers.motion_capture.settings import parse_source
from drivers.motion_capture.wire.ros2_pose import encode_pose
from drivers.rmw_zenoh.wire.cdr import CdrWriter

MS, S = 1_000_000, 1_000_000_000
KEY = "0/mocap/{}/pose/geometry_msgs::msg::dds_::{}_/RIHS01_x"
PLACE, TURN = (1.0, 2.0, 3.0), (0.0, 0.0, 0.0, 1.0)


class Router:
    """A source at a router that says what it is told to, at times of a manual clock."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.now_ns = 1000 * S
        monkeypatch.setattr(ros2_source, "RouterSession", lambda *_: SimpleNamespace(close=lambda: None))
        monkeypatch.setattr("groundstation.bus.clock.now_ns", lambda: self.now_ns)
        self.source = Ros2Source(parse_source("ros2://127.0.0.1/mocap"))

    def say(self, body: str = "cf1", age_ms: int = 0, publisher: bytes = b"a") -> Any:
        self.source._hear(
            KEY.format(body, "PoseStamped"), encode_pose(self.now_ns - age_ms * MS, PLACE, TURN), publisher
        )

    def say_uncertainly(self, variance: float) -> None:
        covariance = [variance if at % 7 == 0 else 0.0 for at in range(36)]
        pose = CdrWriter().header(self.now_ns, "world").numbers("d", *PLACE, *TURN, *covariance)
        self.source._hear(KEY.format("cf1", "PoseWithCovarianceStamped"), pose.payload, b"a")

    def frame(self) -> Any:
        (frame,) = self.source.poll(0.0)
        return frame


@pytest.fixture
def router(monkeypatch: pytest.MonkeyPatch) -> Router:
    return Router(monkeypatch)


def test_each_pose_of_a_frame_is_dated_back_by_what_it_alone_is_late(router: Router) -> None:
    for late_ms in (0, 0, 0, 150, 0):
        router.now_ns += 20 * MS
        router.say("cf2", late_ms + 3, b"b")
        router.now_ns += 2 * MS
        router.say("cf1", 3)
        frame = router.frame()
        assert frame.arrival_ns == router.now_ns and frame.processing_ns == 0
        assert frame.behind_ns["cf1"] / MS == pytest.approx(0, abs=0.1)
        assert frame.behind_ns["cf2"] / MS == pytest.approx(late_ms + 2, abs=0.1), "it came 2 ms before the other"
    assert router.source.rejected == {}


def test_an_uncertain_pose_says_so_and_a_useless_one_is_refused(router: Router) -> None:
    router.say_uncertainly(0.04)
    assert router.frame().deviations == {"cf1": pytest.approx((0.2, 0.2, 0.2, 0.2))}
    router.now_ns += 20 * MS
    router.say_uncertainly(1e6)
    assert not router.source.poll(0.0) and router.source.rejected == {"uncertain pose": 1}
    assert router.source.detail == "uncertain pose of cf1"
