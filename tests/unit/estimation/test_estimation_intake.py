"""Refusals by the estimator's ingest, with the verdict that names the reason; none of it reaches the filter."""

import math
from dataclasses import replace
from typing import Any

import msgspec
import numpy as np
import pytest

from groundstation.bus.messages import (
    ClockOffset,
    FlightState,
    Header,
    Odometry,
    PoseHypothesis,
    RelativeObservation,
    VehicleStatus,
    Verdict,
)
from groundstation.estimation.fixed_lag import FixedLagFilter
from groundstation.estimation.ingest import REASONS, Intake
from groundstation.estimation.models import ConstantVelocityTarget, FixedMount, MountedCamera, OdometryRobot
from groundstation.estimation.models.protocol import MotionModel
from groundstation.estimation.parameters import WORLD_FROM_DOWN, EstimatorParameters

MS = 1_000_000
NOW = 7_000_000 * MS
HOUR_NS = 3_600_000 * MS
COVARIANCE = tuple(np.diag([1e-4, 1e-4, 4e-4, 1e-3]).ravel().tolist())


class Desk:
    """An ingest with a filter of one drone, a target and a ceiling camera; each message has its own number."""

    def __init__(self) -> None:
        entities: dict[str, MotionModel] = {
            "drone": OdometryRobot(),
            "rover": ConstantVelocityTarget(),
            "ceiling": FixedMount((0.0, 0.0, 4.2), 0.003, 0.01),
        }
        camera = MountedCamera("ceiling", WORLD_FROM_DOWN, observes_targets=False)
        self.filter = FixedLagFilter(EstimatorParameters(entities, {"ceiling": camera}, fastest_m_s={"drone": 5.0}))
        self.intake, self.seq = Intake(self.filter, {"ceiling": camera}, "here"), 0

    def header(self, entity: str, age_ns: int = 0, clock: str = "here") -> Header:
        self.seq += 1
        return Header(NOW - age_ns, clock, entity, entity, self.seq)

    def sight(self, age_ns: int = 50 * MS, **changes: Any) -> RelativeObservation:
        return forced(
            RelativeObservation(
                header=self.header("ceiling", age_ns), observer="ceiling", subject="drone", camera="ceiling",
                position_m=(0.1, 0.2, 2.9 + 1e-6 * self.seq), yaw_rad=0.1, covariance=COVARIANCE,
            ),
            changes,
        )  # fmt: skip

    def odometry(self, age_ns: int = 0, **changes: Any) -> Odometry:
        return forced(
            Odometry(
                header=self.header("drone", age_ns), velocity_m_s=(0.1, 0.0, 0.0), velocity_covariance=(0.01,) * 9,
                yaw_rad=1e-6 * self.seq, roll_rad=0.0, pitch_rad=0.0, height_m=1.2,
            ),
            changes,
        )  # fmt: skip

    def status(self, state: FlightState, age_ns: int = 0) -> VehicleStatus:
        return VehicleStatus(header=self.header("drone", age_ns), flight_state=state, mode="TRACK")

    def take(self, message: Any, now_ns: int = NOW) -> Verdict:
        return self.intake.take(type(message).__name__, message, now_ns)


def forced(message: Any, changes: dict[str, Any]) -> Any:
    """Return a message with values that its constructor would refuse."""
    for name, value in changes.items():
        msgspec.structs.force_setattr(message, name, value)
    return message


def covariance(**changes: float) -> tuple[float, ...]:
    values = list(COVARIANCE)
    for name, value in changes.items():
        values[int(name[1:])] = value
    return tuple(values)


BAD_SIGHTS: list[tuple[dict[str, Any], Verdict]] = [
    ({"position_m": (math.nan, 0.0, 3.0)}, Verdict.IMPLAUSIBLE),
    ({"position_m": (0.0, -1e308, 3.0)}, Verdict.IMPLAUSIBLE),
    ({"position_m": (0.0, 3.0)}, Verdict.IMPLAUSIBLE),
    ({"yaw_rad": math.inf}, Verdict.IMPLAUSIBLE),
    ({"roll_rad": math.nan}, Verdict.IMPLAUSIBLE),
    ({"covariance": (math.nan,) * 16}, Verdict.IMPLAUSIBLE),
    ({"covariance": covariance(_0=1e220)}, Verdict.IMPLAUSIBLE),
    ({"covariance": ()}, Verdict.SINGULAR),
    ({"covariance": COVARIANCE[:9]}, Verdict.SINGULAR),
    ({"yaw_rad": None}, Verdict.SINGULAR),
    ({"covariance": covariance(_0=-1e-4)}, Verdict.SINGULAR),
    ({"covariance": covariance(_5=0.0)}, Verdict.SINGULAR),
    ({"covariance": covariance(_1=5e-5)}, Verdict.SINGULAR),
    ({"alternative": PoseHypothesis((0.0, math.inf, 3.0), 0.0, COVARIANCE)}, Verdict.IMPLAUSIBLE),
    ({"alternative": PoseHypothesis((0.0, 0.0, 3.0), 0.0, COVARIANCE[:9])}, Verdict.SINGULAR),
    ({"alternative": PoseHypothesis((0.0, 0.0, 3.0), 0.0, covariance(_15=-1.0))}, Verdict.SINGULAR),
    ({"alternative": PoseHypothesis((0.0, 0.0, 3.0), None, (1e-4, 0, 0, 0, 1e-4, 0, 0, 0, 1e-4))}, Verdict.SINGULAR),
    ({"observer": "drone"}, Verdict.UNKNOWN_ENTITY),
    ({"subject": "stranger"}, Verdict.UNKNOWN_ENTITY),
    ({"subject": "ceiling"}, Verdict.UNKNOWN_ENTITY),
    ({"subject": "rover"}, Verdict.NOT_PERMITTED),
]
BAD_ODOMETRY: list[tuple[dict[str, Any], Verdict]] = [
    ({"velocity_m_s": (0.0,)}, Verdict.IMPLAUSIBLE),
    ({"velocity_m_s": (1e308, 0.0, 0.0)}, Verdict.IMPLAUSIBLE),
    ({"velocity_m_s": (3.0, -3.0, 3.0)}, Verdict.IMPLAUSIBLE),
    ({"yaw_rad": math.nan}, Verdict.IMPLAUSIBLE),
    ({"pitch_rad": math.nan}, Verdict.IMPLAUSIBLE),
    ({"height_m": -math.inf}, Verdict.IMPLAUSIBLE),
    ({"attitude_std_rad": 1e160}, Verdict.IMPLAUSIBLE),
    ({"velocity_covariance": (1e300,) + (0.0,) * 8}, Verdict.IMPLAUSIBLE),
]


@pytest.mark.parametrize(("changes", "verdict"), BAD_SIGHTS)
def test_an_unusable_sight_is_refused_by_name(changes: dict[str, Any], verdict: Verdict) -> None:
    desk = Desk()
    assert desk.take(desk.sight(**changes)) is verdict
    assert verdict in REASONS
    desk.filter.advance(NOW)
    assert desk.filter.take_corrections() == [], "nothing of it may reach the filter"


@pytest.mark.parametrize(("changes", "verdict"), BAD_ODOMETRY)
def test_unusable_odometry_is_refused_by_name(changes: dict[str, Any], verdict: Verdict) -> None:
    desk = Desk()
    assert desk.take(desk.odometry(**changes)) is verdict


@pytest.mark.parametrize(("age_ns", "verdict"), [(HOUR_NS, Verdict.LATE), (-HOUR_NS, Verdict.IMPLAUSIBLE)])
def test_stamps_an_hour_off_are_refused(age_ns: int, verdict: Verdict) -> None:
    desk = Desk()
    assert desk.take(desk.sight(age_ns)) is verdict
    assert desk.take(desk.odometry(age_ns)) is verdict


def test_a_clock_whose_offset_jumps_by_an_hour_counts_again_when_it_is_right() -> None:
    desk = Desk()
    expected = {0: Verdict.ACCEPTED, -HOUR_NS: Verdict.LATE, HOUR_NS: Verdict.IMPLAUSIBLE}
    assert desk.take(desk.sight(header=desk.header("ceiling", 50 * MS, "there"))) is Verdict.UNSYNCED
    for error_ns in (0, -HOUR_NS, HOUR_NS, 0):
        desk.take(ClockOffset(header=desk.header("team"), of="there", offset_ns=error_ns))
        message = desk.sight(header=desk.header("ceiling", 50 * MS, "there"))
        assert desk.take(message) is expected[error_ns]


def test_a_duplicate_is_known_at_any_rate_and_an_old_one_is_late() -> None:
    """2,000 messages within the rewind: more than are remembered at a low rate."""
    desk = Desk()
    first = desk.odometry(400 * MS)
    assert desk.take(first) is Verdict.ACCEPTED
    for _ in range(2000):
        assert desk.take(desk.odometry(100 * MS)) is Verdict.ACCEPTED
    assert desk.take(first) is Verdict.DUPLICATE
    late = NOW + 1000 * MS
    for k in range(600):
        desk.take(desk.odometry(-(900 * MS + k)), late)
    assert desk.take(first, late) is Verdict.LATE


def test_only_the_newest_word_on_flying_may_come_late() -> None:
    desk = Desk()
    assert desk.take(desk.status(FlightState.FLYING, 2000 * MS)) is Verdict.ACCEPTED, "late, but the first"
    assert desk.take(desk.status(FlightState.FLYING, 100 * MS)) is Verdict.ACCEPTED
    assert desk.take(desk.status(FlightState.LANDED, 5000 * MS)) is Verdict.LATE
    assert desk.take(desk.status(FlightState.LANDED, -HOUR_NS)) is Verdict.IMPLAUSIBLE
    desk.filter.advance(NOW)
    assert desk.filter.airborne("drone")


def test_a_standing_vehicle_may_repeat_itself() -> None:
    desk = Desk()
    desk.take(desk.status(FlightState.LANDED, 600 * MS))
    still = [desk.take(desk.odometry((500 - 10 * k) * MS, yaw_rad=0.5), NOW - (500 - 10 * k) * MS) for k in range(50)]
    assert Verdict.FROZEN not in still
    desk.take(desk.status(FlightState.FLYING))
    assert desk.take(desk.odometry(-1 * MS, yaw_rad=0.5)) is Verdict.FROZEN


@pytest.mark.parametrize("steps", [False, True])
def test_a_vehicle_that_tells_coarse_steps_may_repeat_itself_in_flight(steps: bool) -> None:
    desk = Desk()
    joint = FixedLagFilter(replace(desk.filter.parameters, tells_steps=frozenset(["drone"] if steps else [])))
    intake = Intake(joint, joint.parameters.sensors, "here")
    still = [
        intake.take("o", desk.odometry((500 - 10 * k) * MS, yaw_rad=0.5), NOW - (500 - 10 * k) * MS) for k in range(60)
    ]
    assert (Verdict.FROZEN in still) is not steps


def test_a_sensor_that_repeats_itself_is_frozen_and_thaws() -> None:
    desk = Desk()
    ages = [(500 - 10 * k) * MS for k in range(50)]
    still = [desk.take(desk.odometry(age, yaw_rad=0.5), NOW - age) for age in ages]
    assert still[0] is Verdict.ACCEPTED
    assert desk.take(desk.odometry(-20 * MS, yaw_rad=0.5)) is Verdict.FROZEN
    assert desk.take(desk.odometry(-30 * MS, yaw_rad=0.5000001)) is Verdict.ACCEPTED
    sights = [desk.take(desk.sight(age, position_m=(0.1, 0.2, 2.9)), NOW - age) for age in ages[::5]]
    assert sights[0] is Verdict.ACCEPTED
    assert sights[1:6] == [Verdict.DUPLICATE] * 5, "the same picture again measures nothing"
    assert sights[-1] is Verdict.FROZEN


def test_a_picture_that_hangs_is_frozen_whatever_its_detector_makes_of_it() -> None:
    """Observed at the wire: two poses in turn, 0.2 um apart, for the search began where the belief had the marker."""
    desk = Desk()
    ages = [(500 - 50 * k) * MS for k in range(10)]
    poses = [(0.1, 0.2, 2.9349272622 - 1e-7 * (k % 2)) for k in range(10)]
    sights = [
        desk.take(desk.sight(age, position_m=pose, picture_ns=NOW - 600 * MS), NOW - age)
        for age, pose in zip(ages, poses, strict=True)
    ]
    assert sights[1:5] == [Verdict.DUPLICATE] * 4
    assert sights[-1] is Verdict.FROZEN
    assert desk.take(desk.sight(position_m=(0.1, 0.2, 2.9001))) is Verdict.ACCEPTED


@pytest.mark.parametrize("early", [False, True])
def test_only_who_has_to_be_known_before_its_lift_off_joins_while_it_takes_off(early: bool) -> None:
    desk = Desk()
    joint = FixedLagFilter(replace(desk.filter.parameters, joins_early=frozenset(["drone"] if early else [])))
    intake = Intake(joint, joint.parameters.sensors, "here")
    status = VehicleStatus(
        header=desk.header("drone", 100 * MS), flight_state=FlightState.TAKING_OFF, mode="TAKING_OFF"
    )
    intake.take("status/drone", status, NOW)
    joint.advance(NOW)
    assert joint.airborne("drone") is early


@pytest.mark.parametrize(
    ("state", "mode", "known"),
    [
        (FlightState.LANDING, "LANDING", True),
        (FlightState.LOST, "TRACK", True),
        (FlightState.LOST, "LANDING", True),
        (FlightState.LOST, "LANDED", False),
        (FlightState.LOST, "CUT", False),
        (FlightState.LOST, "TAKING_OFF", False),
        (FlightState.UNKNOWN, "CONNECTING", False),
    ],
)
def test_airborne_robots_are_known_to_a_tracker_started_later(state: FlightState, mode: str, known: bool) -> None:
    desk = Desk()
    status = VehicleStatus(header=desk.header("drone", 100 * MS), flight_state=state, mode=mode)
    assert desk.take(status) is Verdict.ACCEPTED
    desk.filter.advance(NOW)
    assert desk.filter.airborne("drone") is known


def test_a_standing_robot_that_falls_silent_is_not_airborne() -> None:
    desk = Desk()
    for age_ns, state in ((200 * MS, FlightState.LANDED), (100 * MS, FlightState.LOST)):
        desk.take(VehicleStatus(header=desk.header("drone", age_ns), flight_state=state, mode="LANDED"))
    desk.filter.advance(NOW)
    assert not desk.filter.airborne("drone")
