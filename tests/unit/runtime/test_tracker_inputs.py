"""The tracker's inputs: joining, leaving, re-initialisation; unusable input gives a verdict, never an exception."""

import itertools
import math

import msgspec
import numpy as np
import pytest
from hovering_team import MS, PLACES, TARGET, Flight

from groundstation import tracker
from groundstation.bus.messages import (
    ClockOffset,
    FlightState,
    Header,
    PoseHypothesis,
    Severity,
    Verdict,
)
from groundstation.control.flight_mode import FlightMode
from groundstation.control.setpoints import Setpoint
from groundstation.field.resolved import ResolvedField
from groundstation.geometry.rotations import rotation_z


@pytest.fixture
def flight(lab_field: ResolvedField) -> Flight:
    return Flight(lab_field)


@pytest.fixture
def tracking(flight: Flight) -> Flight:
    flight.fly("drone_1", "drone_2")
    flight.run(1.0)
    return flight


def test_robots_and_target_join_where_they_are(tracking: Flight) -> None:
    belief = tracking.tracker.belief
    assert belief.layout.robots == ("drone_1", "drone_2")
    assert belief.layout.targets == ("turtlebot",)
    for name, place in PLACES.items():
        np.testing.assert_allclose(belief.mean_of(name)[:3], place, atol=0.03)
    np.testing.assert_allclose(belief.mean_of("turtlebot")[:2], TARGET[:2], atol=0.05)
    block = belief.layout.block("turtlebot")
    cross = belief.covariance[block.slice, belief.layout.block("drone_1").slice]
    assert np.abs(cross[:2, :2]).max() > 1e-6, "what the target is known by is the drone: they must be correlated"
    assert {str(v.severity) for v in tracking.notices} == {"INFO"}


def test_nobody_joins_on_the_ground(flight: Flight) -> None:
    flight.run(0.2)
    assert flight.tracker.belief.layout.robots == ()
    assert flight.tracker.setpoints(flight.now) == {}
    assert {c.verdict for c in flight.corrections} == {Verdict.UNKNOWN_ENTITY}


def test_with_the_drones_on_the_ground_the_targets_covariance_grows_without_bound(tracking: Flight) -> None:
    tracking.fly("drone_1", "drone_2", state=FlightState.LANDED)
    traces = []
    for _ in range(4):
        tracking.run(10.0)
        belief = tracking.tracker.belief
        assert belief.layout.robots == ()
        traces.append(float(np.trace(belief.covariance_of("turtlebot")[:2, :2])))
    assert all(later > 2 * earlier for earlier, later in itertools.pairwise(traces))
    assert traces[-1] > 30.0
    assert tracking.tracker.filter.is_sound()


def test_a_landed_drone_leaves_and_comes_back(tracking: Flight) -> None:
    tracking.fly("drone_1", state=FlightState.LANDED)
    tracking.run(0.1)
    assert tracking.tracker.belief.layout.robots == ("drone_2",)
    assert tracking.tracker.topology.robots == {"drone_2"}
    tracking.fly("drone_1")
    tracking.run(0.2)
    assert set(tracking.tracker.belief.layout.robots) == {"drone_1", "drone_2"}


def test_a_ceiling_camera_must_not_see_the_target(tracking: Flight) -> None:
    before = tracking.tracker.belief
    seen = tracking.sighting("ceiling", "turtlebot", (0.2, -0.3, 3.8), 0.0, 50)
    assert tracking.ingest(seen) is Verdict.NOT_PERMITTED
    after = tracking.tracker.advance(tracking.now)
    assert np.array_equal(before.mean, after.mean)


def test_bad_inputs_are_verdicts_and_leave_the_belief_untouched(tracking: Flight) -> None:
    t = tracking
    t.tracker.advance(t.now)
    before = t.tracker.belief
    bad = msgspec.structs.force_setattr
    nan_odometry, nan_sight = t.odometry("drone_1"), t.ceiling("drone_1")
    bad(nan_odometry, "yaw_rad", math.nan)
    bad(nan_sight, "position_m", (math.inf, 0.0, 3.0))
    huge_odometry, huge_sight = t.odometry("drone_1"), t.ceiling("drone_1")
    bad(huge_odometry, "velocity_m_s", (1e308, 0.0, 0.0))
    bad(huge_sight, "position_m", (0.0, -1e308, 3.0))
    repeated = t.ceiling("drone_1", age_ms=400)
    cases = [
        (nan_odometry, Verdict.IMPLAUSIBLE),
        (nan_sight, Verdict.IMPLAUSIBLE),
        (huge_odometry, Verdict.IMPLAUSIBLE),
        (huge_sight, Verdict.IMPLAUSIBLE),
        (t.sighting("ceiling", "stranger", (0, 0, 3), 0.0, 50), Verdict.UNKNOWN_ENTITY),
        (t.sighting("stranger", "drone_1", (0, 0, 3), 0.0, 50), Verdict.UNKNOWN_ENTITY),
        (t.sighting("drone_1", "drone_1", (0, 0, 3), 0.0, 50), Verdict.UNKNOWN_ENTITY),
        (t.odometry("stranger"), Verdict.UNKNOWN_ENTITY),
        (t.odometry("turtlebot"), Verdict.UNKNOWN_ENTITY),
        (t.ceiling("drone_1", age_ms=3_600_000), Verdict.LATE),
        (t.ceiling("drone_1", age_ms=-3_600_000), Verdict.IMPLAUSIBLE),
        (t.ceiling("drone_1", header=t.header("ceiling", 50, "elsewhere")), Verdict.UNSYNCED),
        (t.ceiling("drone_1", header=t.header("drone_2", 50)), Verdict.UNKNOWN_ENTITY),
    ]
    for message, verdict in cases:
        assert t.ingest(message) is verdict, message
    after = t.tracker.advance(t.now)
    assert np.array_equal(before.mean, after.mean)
    assert np.array_equal(before.covariance, after.covariance)
    assert t.ingest(repeated) is None
    assert t.ingest(repeated) is Verdict.DUPLICATE
    assert sum(t.tracker.rejected.values()) == len(cases) + 1


def test_unusable_observations_get_a_verdict_from_the_filter(tracking: Flight) -> None:
    t = tracking
    indefinite = np.diag([1e-4, 1e-4, 4e-4, 1e-3])
    indefinite[0, 1] = indefinite[1, 0] = 2e-4
    for message in (
        t.ceiling("drone_1", covariance=tuple(indefinite.ravel().tolist())),
        t.sighting("ceiling", "drone_1", (0.0, 0.0, -2.0), 0.0, 50),
        t.sighting("ceiling", "drone_1", (9.0, 9.0, 2.0), 0.0, 50),
    ):
        assert t.ingest(message) is None
    t.tracker.advance(t.now)
    verdicts = [c.verdict for c in t.tracker.take_corrections()]
    assert sorted(verdicts) == sorted([Verdict.SINGULAR, Verdict.OUT_OF_VIEW, Verdict.IMPLAUSIBLE])


def test_another_clock_counts_once_its_offset_is_known(tracking: Flight) -> None:
    t = tracking
    t.now += 20 * MS
    offset = ClockOffset(header=t.header("team"), of="elsewhere", offset_ns=5_000_000_000)
    assert t.ingest(offset) is None
    header = Header(t.now - 5_000_000_000 - 50 * MS, "elsewhere", "ceiling", "ceiling", 99_999)
    assert t.ingest(t.ceiling("drone_1", header=header)) is None
    t.tracker.advance(t.now)
    assert [c.verdict for c in t.tracker.take_corrections()] == [Verdict.ACCEPTED]


def test_the_more_likely_of_two_poses_is_used(tracking: Flight) -> None:
    t = tracking
    right = t.ceiling("drone_1")
    wrong_place = (right.position_m[0] + 0.4, right.position_m[1], right.position_m[2])
    swapped = t.ceiling(
        "drone_1",
        position_m=wrong_place,
        alternative=PoseHypothesis(right.position_m, right.yaw_rad, right.covariance),
    )
    t.ingest(swapped)
    t.tracker.advance(t.now)
    (correction,) = t.tracker.take_corrections()
    assert correction.verdict is Verdict.ACCEPTED
    assert "other pose" in correction.reason


def test_outliers_do_not_move_the_belief_but_a_kidnapped_target_is_found_again(tracking: Flight) -> None:
    t = tracking
    t.target = TARGET + np.array([1.5, -1.0, 0.0])
    t.ingest(t.onboard("drone_1"))
    t.tracker.advance(t.now)
    assert t.tracker.take_corrections()[-1].verdict is Verdict.IMPLAUSIBLE
    np.testing.assert_allclose(t.tracker.belief.mean_of("turtlebot")[:2], TARGET[:2], atol=0.06)
    t.run(1.5)
    np.testing.assert_allclose(t.tracker.belief.mean_of("turtlebot")[:2], t.target[:2], atol=0.06)
    assert any(n.severity is Severity.WARNING and n.entity == "turtlebot" for n in t.notices)
    np.testing.assert_allclose(t.tracker.belief.mean_of("drone_1")[:3], PLACES["drone_1"], atol=0.04)


def test_a_kidnapped_robot_is_found_again_alone(tracking: Flight) -> None:
    t = tracking
    t.places["drone_1"] += np.array([0.8, 0.9, 0.0])
    t.run(1.0, onboard=False)
    np.testing.assert_allclose(t.tracker.belief.mean_of("drone_1")[:3], t.places["drone_1"], atol=0.04)
    np.testing.assert_allclose(t.tracker.belief.mean_of("drone_2")[:3], PLACES["drone_2"], atol=0.04)
    assert {n.entity for n in t.notices if n.severity is Severity.WARNING} == {"drone_1", "turtlebot"}  # both unseen


def test_a_heading_jump_with_reset_does_not_turn_the_robot(tracking: Flight) -> None:
    t = tracking
    t.now += 20 * MS
    t.ingest(t.odometry("drone_1", yaw_rad=2.0, reset=1))
    t.now += 20 * MS
    t.ingest(t.odometry("drone_1", yaw_rad=2.1, reset=1))
    t.tracker.advance(t.now + 20 * MS)
    assert t.tracker.belief.mean_of("drone_1")[3] == pytest.approx(0.1, abs=0.02)


def test_reported_velocity_moves_the_robot_in_its_own_frame(tracking: Flight) -> None:
    t = tracking
    before = t.tracker.belief.mean_of("drone_1").copy()
    for _ in range(25):
        t.now += 20 * MS
        t.ingest(t.odometry("drone_1", velocity_m_s=(0.5, 0.0, 0.0), yaw_rad=math.pi / 2, reset=1))
    t.tracker.advance(t.now)
    moved = t.tracker.belief.mean_of("drone_1")[:2] - before[:2]
    # The jump of the heading is void: the robot still looks along world x. 0.5 m/s x 1.18 for some 0.5 s.
    np.testing.assert_allclose(moved, rotation_z(float(before[3]))[:2, 0] * 0.29, atol=0.06)


def test_a_broken_covariance_means_hold_hover_and_a_new_epoch(tracking: Flight) -> None:
    t = tracking
    epoch = t.tracker.epoch
    t.tracker.filter._checkpoints.covariances[:] = np.nan
    t.run(0.02, look=False, onboard=False)
    assert t.tracker.holding
    assert t.tracker.epoch == epoch + 1
    assert any(n.severity is Severity.ERROR for n in t.notices)
    limited = t.tracker.setpoints(t.now)
    assert set(limited) == {"drone_1", "drone_2"}
    assert all(entry.setpoint.velocity_m_s == (0.0, 0.0, 0.0) for entry in limited.values())
    t.run(0.5)
    assert not t.tracker.holding
    assert t.tracker.filter.is_sound()
    assert set(t.tracker.belief.layout.robots) == {"drone_1", "drone_2"}


def test_after_a_broken_covariance_no_drone_waits_for_one_that_is_not_found(tracking: Flight) -> None:
    t = tracking
    t.unseen.add("drone_2")
    t.tracker.filter._checkpoints.covariances[:] = np.nan
    t.run(0.02, look=False, onboard=False)
    assert t.tracker.holding == {"drone_1", "drone_2"}
    t.run(0.5)
    assert t.tracker.holding == {"drone_2"} and t.tracker.plan() is not None
    limited = t.tracker.setpoints(t.now)
    assert limited["drone_2"].limited_by == ("hold",) and limited["drone_1"].setpoint.phase is FlightMode.TRACK
    t.fly("drone_2", state=FlightState.LANDED)
    t.run(0.1)
    assert not t.tracker.holding
    t.fly("drone_2")
    t.run(0.1)
    assert not t.tracker.holding, "a new take-off has nothing to do with the fault"


def test_plan_and_setpoints_follow_from_the_belief(tracking: Flight) -> None:
    plan = tracking.tracker.plan()
    assert plan is not None
    assert plan.topology.robots == {"drone_1", "drone_2"}
    limited = tracking.tracker.setpoints(tracking.now)
    assert {entry.setpoint.phase for entry in limited.values()} == {FlightMode.TRACK}
    for entry in limited.values():
        assert math.hypot(*entry.setpoint.velocity_m_s[:2]) <= 0.6 + 1e-9


def test_a_drone_that_takes_off_is_kept_clear_of_although_it_is_not_in_the_belief(
    flight: Flight, monkeypatch: pytest.MonkeyPatch
) -> None:
    apart_m, speed_m_s = 1.05, 0.5
    flight.places["drone_2"] = flight.places["drone_1"] - np.array([0.0, apart_m, 0.8])
    flight.fly("drone_1")
    flight.fly("drone_2", state=FlightState.TAKING_OFF)
    flight.run(1.0)
    assert flight.tracker.belief.layout.robots == ("drone_1",)
    wish = Setpoint((0.0, -speed_m_s, 0.0), 0.0, FlightMode.TRACK)
    monkeypatch.setattr(tracker, "setpoints_from_plan", lambda *_: {"drone_1": wish})
    sent = flight.tracker.setpoints(flight.now)["drone_1"]
    assert sent.limited_by == ("separation",)
    assert abs(sent.setpoint.velocity_m_s[1]) <= (apart_m - 0.75) / 2.0


def test_an_airborne_robot_nobody_has_seen_hovers(flight: Flight) -> None:
    flight.fly("drone_1")
    flight.run(0.1, look=False, onboard=False)
    assert flight.tracker.setpoints(flight.now)["drone_1"].setpoint.velocity_m_s == (0.0, 0.0, 0.0)
    assert not flight.tracker.converged("drone_1")


def test_estimates_say_who_is_where_and_since_when(tracking: Flight) -> None:
    tracking.run(0.5, look=False, onboard=False)
    estimates = {e.name: e for e in tracking.tracker.estimates()}
    assert set(estimates) == {"drone_1", "drone_2", "turtlebot"}
    assert (len(estimates["drone_1"].mean), len(estimates["turtlebot"].mean)) == (4, 2)
    assert estimates["drone_1"].age_s == pytest.approx(0.55, abs=0.03)
    assert estimates["drone_1"].converged
