"""The motion capture driver with bodies whose poses come one by one: each has its own turn and its own date."""

from collections import Counter
from types import SimpleNamespace
from typing import Any

import pytest

from drivers.motion_capture.captured_frame import CapturedFrame
from drivers.motion_capture.driver import MotionCaptureDriver
from drivers.motion_capture.settings import MotionCaptureSection
from groundstation.bus.memory_bus import MemoryBus, MemoryExchange
from groundstation.bus.messages import BodyPoses, CameraStatus, RelativeObservation
from groundstation.bus.topics import BODY_POSES, CAMERA_STATUS, OBSERVATION

MS = 1_000_000
TURN = (0.0, 0.0, 0.0, 1.0)
PLACES = {"drone_1": (0.5, 0.2, 1.5), "drone_2": (-0.9, 0.1, 1.4)}
SECTION = MotionCaptureSection.model_validate(
    {
        "name": "mocap",
        "source": "ros2://127.0.0.1/mocap",
        "bodies": [{"entity": name, "name": name} for name in PLACES],
        "observed": list(PLACES),
        "volume_m": [(-3.0, 3.0)] * 3,
        "delay_ms": 0.0,
    }
)


class Hall:
    """The driver, with a source of frames at times of a manual clock; bodies jitter by their count of poses."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.now_ns, self.count = 1000 * 1000 * MS, 0
        monkeypatch.setattr("groundstation.bus.clock.now_ns", lambda: self.now_ns)
        exchange = MemoryExchange()
        self.events: list[str] = []
        nothing: Any = lambda *_, **__: None  # noqa: E731 - of its host the driver uses no more
        child: Any = SimpleNamespace(
            bus=MemoryBus(exchange, "lab", "mocap"), ready=nothing, degrade=nothing, beat=nothing, tick_status=nothing,
            event=lambda _severity, text, *_, **__: self.events.append(text),
        )  # fmt: skip
        self._heard = MemoryBus(exchange, "lab", "test").subscribe([OBSERVATION, BODY_POSES, CAMERA_STATUS])
        self._came: list[CapturedFrame] = []
        source: Any = SimpleNamespace(poll=lambda _: self._taken(), rejected=Counter(), detail="")
        self.driver = MotionCaptureDriver(child, SECTION, source)

    def _taken(self) -> list[CapturedFrame]:
        came, self._came = self._came, []
        return came

    def pose(self, name: str) -> Any:
        self.count += 1
        x, y, z = PLACES.get(name, (0.0, 0.0, 1.0))
        return (x + 1e-4 * (self.count % 7), y, z), TURN

    def comes(self, *names: str, **more: Any) -> None:
        """Let one frame with these bodies come now."""
        self.give({name: self.pose(name) for name in names}, **more)

    def give(self, poses: dict[str, Any], **more: Any) -> None:
        self._came.append(CapturedFrame(self.now_ns, 0, poses, **more))
        self.driver.turn()

    def heard(self, kind: type) -> list[Any]:
        return [one.message for one in self._heard.drain() if isinstance(one.message, kind)]


@pytest.fixture
def hall(monkeypatch: pytest.MonkeyPatch) -> Hall:
    return Hall(monkeypatch)


@pytest.mark.parametrize(("rate_hz", "apart_ms"), [(30, 10), (60, 8), (120, 4), (15, 10), (100, 5)])
def test_bodies_whose_poses_come_apart_are_all_observed(hall: Hall, rate_hz: int, apart_ms: int) -> None:
    seconds, least = 10, min(30, rate_hz)
    seen = dict.fromkeys(PLACES, 0)
    for count in range(seconds * rate_hz):
        hall.now_ns = 10**12 + round(count * 1e9 / rate_hz)
        hall.comes("drone_1")
        hall.now_ns += apart_ms * MS
        hall.comes("drone_2")
        for one in hall.heard(RelativeObservation):
            seen[one.subject] += 1
    assert all(0.9 * least <= number / seconds <= 1.1 * least for number in seen.values()), seen


def test_bodies_of_one_frame_stay_together(hall: Hall) -> None:
    for _ in range(200):
        hall.now_ns += 10 * MS
        hall.comes(*PLACES)
    frames = hall.heard(BodyPoses)
    assert 50 <= len(frames) <= 70 and all(len(one.bodies) == 2 for one in frames)


def test_a_body_that_comes_late_delays_and_discards_no_other(hall: Hall) -> None:
    """Both are seen every 20 ms; poses of drone_2 come 50 ms late, between those of drone_1, as of late."""
    used: dict[str, set[int]] = {name: set() for name in PLACES}
    for _ in range(200):
        hall.now_ns += 15 * MS
        hall.comes("drone_1")
        hall.now_ns += 5 * MS
        hall.comes("drone_2", behind_ns={"drone_2": 50 * MS})
        for one in hall.heard(RelativeObservation):
            used[one.subject].add((hall.now_ns - one.header.stamp_ns) // MS)
    assert used == {"drone_1": {5}, "drone_2": {50}} and hall.driver._health.skipped == 0


def test_bodies_of_one_frame_have_dates_of_their_own(hall: Hall) -> None:
    for _ in range(50):
        hall.now_ns += 20 * MS
        hall.comes(*PLACES, behind_ns={"drone_2": 250 * MS})
    poses = hall.heard(BodyPoses)
    ages = {(tuple(body.name for body in one.bodies), one.header.stamp_ns % (20 * MS) // MS) for one in poses}
    assert ages == {(("drone_1",), 0), (("drone_2",), 10)} and not hall.events[1:]


def test_a_pose_that_a_newer_one_of_its_body_overtook_is_skipped(hall: Hall) -> None:
    hall.comes("drone_1")
    hall.now_ns += 50 * MS
    hall.comes("drone_1", "drone_2", behind_ns={"drone_1": 60 * MS})
    assert [one.subject for one in hall.heard(RelativeObservation)] == ["drone_1", "drone_2"]
    assert hall.driver._health.skipped == 1


def test_bodies_that_are_not_ours_do_not_make_a_dead_stream_look_alive(hall: Hall) -> None:
    hall.comes(*PLACES, whole=False)
    assert len(hall.heard(BodyPoses)) == 1
    for _ in range(100):
        hall.now_ns += 20 * MS
        hall.comes("wand", whole=False)
    assert not hall.heard(BodyPoses), "the watch over silence takes each for a sign of life"
    assert hall.events[-1] == "motion capture mocap: no frame for 0.5 s (only other bodies come, such as wand)"
    hall.comes("drone_1", whole=False)
    assert len(hall.heard(BodyPoses)) == 1


def test_a_system_that_says_that_it_tracks_nobody_works(hall: Hall) -> None:
    for _ in range(100):
        hall.now_ns += 20 * MS
        hall.comes()
    frames = hall.heard(BodyPoses)
    assert 50 <= len(frames) <= 62 and not any(one.bodies for one in frames)


def test_a_fault_ends_when_its_body_was_out_of_sight(hall: Hall, monkeypatch: pytest.MonkeyPatch) -> None:
    hall.comes(*PLACES)
    monkeypatch.setitem(PLACES, "drone_1", (1.5, 0.2, 1.5))
    hall.now_ns += 20 * MS
    hall.comes(*PLACES)
    assert hall.events[-1] == "mocap: drone_1 jumped by 1.00 m from one frame to the next"
    for _ in range(80):
        hall.now_ns += 20 * MS
        hall.comes("drone_2")
    assert hall.events[-1] == "mocap: drone_1 is out of sight, and judged anew"
    assert hall.heard(CameraStatus)[-1].detail == ""
    hall.comes("drone_1")
    assert [one.subject for one in hall.heard(RelativeObservation)] == ["drone_1"] and len(hall.events) == 3


def test_a_name_that_was_exchanged_stays_so_while_the_other_is_in_sight(hall: Hall) -> None:
    hall.comes(*PLACES)
    for count in range(80):
        hall.now_ns += 20 * MS
        poses = {name: hall.pose(other) for name, other in zip(PLACES, reversed(PLACES), strict=True)}
        hall.give({name: pose for name, pose in poses.items() if count < 5 or name == "drone_2"})
    assert len(hall.events) == 3 and "drone_1 its name was exchanged" in hall.heard(CameraStatus)[-1].detail
