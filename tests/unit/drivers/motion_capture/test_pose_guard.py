"""Poses of a ROS 2 topic from another publisher, in another frame, or late are not used."""

import pytest

from drivers.motion_capture.pose_guard import PoseGuard

MS, S = 1_000_000, 1_000_000_000


class Says:
    """A guard, and a publisher at 50 Hz with a clock one hour behind ours."""

    def __init__(self) -> None:
        self.guard, self.now_ns = PoseGuard(), 10_000 * S

    def next(self, publisher: bytes = b"a", frame: str = "world", age_ms: int = 5, stamp_ns: int | None = None) -> str:
        self.now_ns += 20 * MS
        told_ns = self.now_ns - 3600 * S - age_ms * MS if stamp_ns is None else stamp_ns
        self.refusal, self.late_ns = self.guard.judge("cf1", publisher, frame, told_ns, self.now_ns)
        return self.refusal


@pytest.mark.parametrize("stamp_ns", [None, 0])
def test_sound_poses_are_used_with_stamps_or_without(stamp_ns: int | None) -> None:
    says = Says()
    assert {says.next(stamp_ns=stamp_ns) for _ in range(100)} == {""}


def test_a_second_publisher_waits_until_the_first_is_silent() -> None:
    says = Says()
    assert [says.next(), says.next(b"b"), says.next()] == ["", "second publisher", ""]
    assert [says.next(b"b") for _ in range(60)][-1] == "", "the first was silent for a second"


def test_a_frame_that_changes_is_another_place() -> None:
    says = Says()
    assert [says.next(), says.next(frame="map"), says.next()] == ["", "another frame", ""]


def test_poses_that_waited_somewhere_are_late() -> None:
    says = Says()
    assert {says.next() for _ in range(50)} == {""}
    assert says.next(age_ms=400) == "late"
    assert says.next() == ""


def test_bodies_have_publishers_of_their_own() -> None:
    guard = PoseGuard()
    assert guard.judge("cf1", b"a", "world", 0, S) == guard.judge("cf2", b"b", "map", 0, S) == ("", 0)


def test_poses_that_are_late_for_good_stay_refused_also_after_a_silence() -> None:
    says = Says()
    assert {says.next() for _ in range(50)} == {""}
    assert {says.next(age_ms=2000) for _ in range(3000)} == {"late"}
    assert says.next() == ""
    says.now_ns += 1200 * MS
    assert {says.next(age_ms=1200) for _ in range(500)} == {"late"}


def test_another_publisher_after_a_silence_has_a_clock_of_its_own() -> None:
    says = Says()
    assert {says.next() for _ in range(50)} == {""}
    says.now_ns += 1200 * MS
    assert {says.next(b"b", frame="map", age_ms=2000) for _ in range(50)} == {""}


def test_a_pose_is_dated_by_how_late_it_came() -> None:
    says = Says()
    for age_ms, late_ms in ((5, 0), (5, 0), (105, 100), (205, 200), (5, 0)):
        says.next(age_ms=age_ms)
        assert says.late_ns / MS == pytest.approx(late_ms, abs=0.1)
