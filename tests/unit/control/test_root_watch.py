"""Whether fixed sensors still locate the team, directly or through observations between robots."""

import math

import numpy as np
import pytest

from groundstation.bus.messages import (
    BodyPose,
    BodyPoses,
    Header,
    Message,
    RelativeObservation,
    SearchedPicture,
    Verdict,
)
from groundstation.control.root_watch import RootWatch
from groundstation.estimation.measurement import Correction

TICK_NS = 100_000_000
CARRIED = ("drone_1", "drone_2", "turtlebot")


def used(observer: str, subject: str, verdict: Verdict = Verdict.ACCEPTED, latency_ms: float = 0.0) -> Correction:
    return Correction(observer, subject, verdict, "", latency_ms=latency_ms)


def ages_s(watch: RootWatch) -> list[float]:
    return [round(watch.age_s(name), 3) for name in CARRIED]


def test_location_by_a_fixed_camera_propagates_along_observations_both_ways() -> None:
    watch = RootWatch(["ceiling"], CARRIED)
    watch.advance(
        TICK_NS, [used("ceiling", "drone_1"), used("drone_1", "turtlebot"), used("drone_2", "turtlebot")], flying=True
    )
    assert ages_s(watch) == [0.0, 0.0, 0.0]


def test_a_robot_is_not_located_by_its_own_information() -> None:
    """Otherwise a robot in view that alone sees a target would locate itself by that target outside of the view."""
    watch = RootWatch(["ceiling"], CARRIED)
    alone = [used("ceiling", "drone_1"), used("drone_1", "turtlebot"), used("drone_1", "turtlebot")]
    watch.advance(TICK_NS, alone, flying=True)
    assert watch.age_s("drone_1") == 0.0 and watch.helped_age_s("drone_1") == math.inf
    assert watch.helped_age_s("turtlebot") == 0.0
    seen = [used("ceiling", "drone_2", latency_ms=100.0), used("drone_2", "turtlebot"), used("drone_1", "turtlebot")]
    watch.advance(2 * TICK_NS, [*seen, used("ceiling", "drone_1")], flying=True)
    assert (watch.age_s("drone_1"), watch.helped_age_s("drone_1")) == pytest.approx((0.0, 0.1))


def test_a_range_roots_a_robot_by_the_name_of_its_link() -> None:
    watch = RootWatch(["uwb"], CARRIED, ["uwb_a1_drone_1"])
    watch.advance(TICK_NS, [used("uwb_a1_drone_1", "drone_1")], flying=True)
    assert ages_s(watch) == [0.0, math.inf, math.inf]


def test_a_round_of_ranges_that_places_a_robot_roots_it() -> None:
    watch = RootWatch(["uwb"], CARRIED, ["uwb_a1_drone_1"])
    watch.advance(TICK_NS, [], [("uwb", "drone_1", False)], flying=True)
    assert ages_s(watch) == [0.0, math.inf, math.inf]


def test_two_that_see_only_each_other_grow_older_together() -> None:
    watch = RootWatch(["ceiling"], CARRIED)
    watch.advance(TICK_NS, [used("ceiling", "drone_1")], flying=True)
    for tick in range(2, 32):
        watch.advance(tick * TICK_NS, [used("drone_1", "drone_2"), used("drone_2", "drone_1")], flying=True)
    assert ages_s(watch) == [3.0, 3.0, math.inf]


@pytest.mark.parametrize("verdict", [Verdict.IMPLAUSIBLE, Verdict.FROZEN, Verdict.LATE])
def test_a_refused_sighting_tells_nothing(verdict: Verdict) -> None:
    watch = RootWatch(["ceiling"], CARRIED)
    watch.advance(TICK_NS, [used("ceiling", "drone_1", verdict)], flying=True)
    assert ages_s(watch) == [math.inf] * 3


def test_a_late_sighting_is_as_old_as_its_picture_and_makes_nobody_older() -> None:
    watch = RootWatch(["ceiling"], CARRIED)
    watch.advance(10 * TICK_NS, [used("ceiling", "drone_1", latency_ms=200.0)], flying=True)
    assert watch.age_s("drone_1") == pytest.approx(0.2)
    watch.advance(10 * TICK_NS, [used("ceiling", "drone_1", latency_ms=500.0)], flying=True)
    assert watch.age_s("drone_1") == pytest.approx(0.2)


def picture(*found: str, observer: str = "ceiling", unmeasured: tuple[str, ...] = ()) -> SearchedPicture:
    header = Header(1, "c", observer, observer, 1)
    return SearchedPicture(header=header, observer=observer, camera=observer, found=found, unmeasured=unmeasured)


def frame(*bodies: str, refused: tuple[str, ...] = (), observer: str = "mocap") -> BodyPoses:
    poses = tuple(BodyPose(name, (0.0, 0.0, 1.0), (0.0, 0.0, 0.0, 1.0)) for name in bodies)
    return BodyPoses(
        header=Header(1, "c", observer, observer, 1), bodies=poses, refused=dict.fromkeys(refused, "frozen")
    )


def sighting(observer: str = "ceiling") -> RelativeObservation:
    return RelativeObservation(
        header=Header(1, "c", observer, observer, 1), observer=observer, subject="drone_1", camera=observer,
        position_m=(0.0, 0.0, 2.0), yaw_rad=None, covariance=tuple(np.eye(3).ravel().tolist()),
    )  # fmt: skip


def silent_after(message: Message | None, ticks: int, roots: tuple[str, ...] = ("ceiling",)) -> list[str]:
    """Return the watch's output while roots that have worked send only this message, each tick."""
    watch, told = RootWatch(roots, CARRIED), []
    for root in roots:
        watch.take(frame() if root == "mocap" else picture(observer=root), TICK_NS)
    for tick in range(1, ticks + 1):
        if message is not None:
            watch.take(message, tick * TICK_NS)
        told += [notice.text for notice in watch.advance(tick * TICK_NS, [], flying=True)]
    assert watch.is_silent == bool(told)
    return told


def test_roots_that_say_nothing_are_silent_after_a_while_and_are_told_of_once() -> None:
    assert silent_after(None, 16) == []
    assert len(silent_after(None, 60)) == 1


def test_one_that_finds_robots_in_a_picture_that_hangs_is_silent() -> None:
    assert len(silent_after(picture("drone_1"), 60)) == 1


def test_a_camera_works_that_cannot_read_a_board() -> None:
    assert silent_after(picture(unmeasured=("drone_1",)), 60) == []


def hangs_after_s(root: str, others: tuple[str, ...] = (), also_new: bool = False) -> float | None:
    """Return the time from the last new observation of a repeating root until nothing locates the team [s]."""
    watch = RootWatch((root, *others), CARRIED)
    watch.take(sighting(root), 0)
    for tick in range(1, 31):
        watch.hear_frozen(sighting(root))
        for one in (*others, *([root] if also_new else [])):
            watch.take(sighting(one), tick * TICK_NS)
        watch.advance(tick * TICK_NS, [], flying=True)
        if watch.is_silent:
            return tick / 10
    return None


@pytest.mark.parametrize("root", ["ceiling", "mocap"])
def test_a_root_that_goes_on_repeating_itself_is_silent_sooner_whether_or_not_it_says_that_it_sees_nobody(
    root: str,
) -> None:
    assert hangs_after_s(root) == 0.6


def test_a_root_does_not_hang_that_repeats_one_robot_and_sees_another_anew() -> None:
    assert hangs_after_s("ceiling", also_new=True) is None


def test_a_root_that_hangs_matters_not_beside_one_that_works() -> None:
    assert hangs_after_s("ceiling", others=("hall_2",)) is None


def test_a_root_is_not_silent_before_anything_was_heard_nor_by_what_is_no_sighting() -> None:
    watch = RootWatch(["ceiling"], CARRIED)
    assert not watch.is_silent
    watch.take(sighting(), 0)
    watch.hear_frozen(picture("drone_1"))
    watch.advance(10 * TICK_NS, [], flying=True)
    assert not watch.is_silent


def test_a_root_that_hung_and_sees_somebody_again_works() -> None:
    watch = RootWatch(["ceiling"], CARRIED)
    watch.take(sighting(), 0)
    watch.hear_frozen(sighting())
    watch.advance(10 * TICK_NS, [], flying=True)
    assert watch.is_silent
    watch.take(sighting(), 10 * TICK_NS)
    assert not watch.is_silent


def test_a_root_that_hung_for_a_moment_has_as_long_as_any_other() -> None:
    watch = RootWatch(["ceiling"], CARRIED)
    watch.hear_frozen(sighting())
    watch.take(sighting(), 0)
    watch.advance(6 * TICK_NS, [], flying=True)
    assert not watch.is_silent


@pytest.mark.parametrize(("hangs", "limit_ms"), [(False, 1500), (True, 500)])
def test_it_is_silent_after_a_second_and_a_half_or_half_a_second_if_it_hangs(hangs: bool, limit_ms: int) -> None:
    watch = RootWatch(["ceiling"], CARRIED)
    watch.take(picture(), 0)
    if hangs:
        watch.hear_frozen(sighting())
    assert not watch.is_silent, "before the first tick"
    watch.advance(limit_ms * 1_000_000, [], flying=True)
    assert not watch.is_silent
    watch.advance(limit_ms * 1_000_000 + 1, [], flying=True)
    assert watch.is_silent


@pytest.mark.parametrize("message", [picture(), sighting()])
def test_one_that_sees_somebody_or_nobody_is_not_silent(message: Message) -> None:
    assert silent_after(message, 60) == []


def test_one_root_that_works_is_enough() -> None:
    assert silent_after(sighting("hall_2"), 60, ("hall_1", "hall_2")) == []


@pytest.mark.parametrize("message", [None, frame("drone_1", observer="truth"), picture("drone_1")])
def test_motion_capture_that_sends_nothing_is_silent_after_a_while(message: Message | None) -> None:
    assert silent_after(message, 16, ("mocap",)) == []
    assert len(silent_after(message, 60, ("mocap",))) == 1


def test_motion_capture_of_which_all_poses_are_refused_is_silent_sooner() -> None:
    refused = frame("drone_1", "drone_2", refused=("drone_1", "drone_2"))
    assert silent_after(refused, 6, ("mocap",)) == []
    assert len(silent_after(refused, 7, ("mocap",))) == 1


@pytest.mark.parametrize(
    "message", [frame(), frame("drone_1"), frame("drone_1", "drone_2", refused=("drone_1",)), sighting("mocap")]
)
def test_motion_capture_works_that_tracks_nobody_or_anybody(message: Message) -> None:
    assert silent_after(message, 60, ("mocap",)) == []
    assert silent_after(message, 60, ("mocap", "ceiling")) == []


def test_the_first_frame_counts_though_it_is_refused() -> None:
    watch = RootWatch(["mocap"], CARRIED)
    watch.take(frame("drone_1", refused=("drone_1",)), TICK_NS)
    watch.advance(6 * TICK_NS, [], flying=True)
    assert not watch.is_silent


def test_a_root_that_never_says_that_it_sees_nobody_is_not_judged() -> None:
    watch = RootWatch(["uwb"], CARRIED)
    watch.take(sighting("uwb"), TICK_NS)
    assert watch.advance(100 * TICK_NS, [], flying=True) == []
    assert not watch.is_silent


def test_nothing_is_told_while_nobody_flies() -> None:
    watch = RootWatch(["ceiling"], CARRIED)
    watch.take(picture(), TICK_NS)
    assert watch.advance(100 * TICK_NS, [], flying=False) == []
    assert watch.is_silent
