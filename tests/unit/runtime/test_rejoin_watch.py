"""Operator warnings about the camera or robot behind repeated re-initialisations."""

from groundstation.bus.messages import Severity, Verdict
from groundstation.estimation.event_log import HASTY
from groundstation.estimation.measurement import Correction
from groundstation.runtime.rejoin_watch import RejoinWatch

S = 1_000_000_000


def given_up(subject: str, observer: str = "ceiling") -> Correction:
    return Correction(observer, subject, Verdict.ACCEPTED, nis=300.0, joined=True)


def put_off(subject: str, observer: str = "ceiling") -> Correction:
    return Correction(observer, subject, Verdict.IMPLAUSIBLE, HASTY, nis=300.0)


def watch() -> RejoinWatch:
    return RejoinWatch(["drone_1", "drone_2"])


def test_one_robot_that_was_lost_is_no_culprits_work() -> None:
    assert watch().take([given_up("drone_1")], S) == []


def test_all_robots_at_once_are_the_cameras_fault_and_that_is_said_once() -> None:
    w = watch()
    assert w.take([given_up("drone_1")], S) == []
    (notice,) = w.take([given_up("drone_2")], 2 * S)
    assert notice.entity == "ceiling"
    assert notice.severity is Severity.WARNING
    assert "drone_1 and drone_2" in notice.text
    assert w.take([given_up("drone_1"), given_up("drone_2")], 8 * S) == []
    assert len(w.take([given_up("drone_1"), given_up("drone_2")], 30 * S)) == 1, "still so, much later"


def test_robots_with_deferred_re_initialisation_count_against_the_camera() -> None:
    w = watch()
    assert w.take([given_up("drone_1")], S) == []
    (notice,) = w.take([put_off("drone_2")] * 5, S + S // 10)
    assert notice.entity == "ceiling" and "drone_1 and drone_2" in notice.text


def test_one_robot_that_is_put_off_was_given_up_three_times_before() -> None:
    w = watch()
    assert w.take([given_up("drone_1")], S) + w.take([given_up("drone_1")], 5 * S) == []
    assert len(w.take([given_up("drone_1")], 9 * S)) == 1
    assert w.take([put_off("drone_1")], 10 * S) == []


def test_two_robots_long_apart_or_by_two_cameras_are_chance() -> None:
    w = watch()
    assert w.take([given_up("drone_1")], S) == []
    assert w.take([given_up("drone_2", "corner")], S) == []
    assert w.take([given_up("drone_2")], 10 * S) == []


def test_one_robot_again_and_again_has_a_cause() -> None:
    w = watch()
    assert w.take([given_up("drone_1")], S) + w.take([given_up("drone_1")], 6 * S) == []
    (notice,) = w.take([given_up("drone_1")], 12 * S)
    assert notice.entity == "drone_1"
    assert "3 times" in notice.text
    assert w.take([given_up("drone_1")], 18 * S) == []


def test_a_first_joining_a_target_and_a_mere_contradiction_say_nothing() -> None:
    w = watch()
    first = Correction("ceiling", "drone_1", Verdict.ACCEPTED, joined=True)
    wild = Correction("ceiling", "drone_1", Verdict.IMPLAUSIBLE, nis=300.0)
    for k in range(1, 6):
        assert w.take([first, wild, given_up("turtlebot")], k * S) == []
