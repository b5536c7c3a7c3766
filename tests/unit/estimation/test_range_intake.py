"""Ingest of ranges: initialisation of a robot and its heading, refusals, reflections."""

import math
from typing import Any

import msgspec
import numpy as np
import pytest

from groundstation.bus.messages import FlightState, Header, Odometry, RangeObservation, VehicleStatus, Verdict
from groundstation.estimation.fixed_lag import FixedLagFilter
from groundstation.estimation.ingest import Intake
from groundstation.estimation.models import Anchor, OdometryRobot, RangeSensor
from groundstation.estimation.models.protocol import MotionModel
from groundstation.estimation.parameters import EstimatorParameters
from groundstation.estimation.ranged_robot import RangedRobot
from groundstation.field.room import ranging_link
from groundstation.geometry.rotations import rotation_z

MS = 1_000_000
START = 7_000_000 * MS
PLACES = {
    "a": (-3.0, -3.0, 2.5),
    "b": (3.0, -3.0, 2.5),
    "c": (3.0, 3.0, 2.5),
    "d": (-3.0, 3.0, 2.5),
    "e": (0.0, 3.0, 0.2),
}
RADIO = (0.1, 0.0, 0.05)
PAD_YAW, POSE = 0.8, (0.5, -0.4, 1.2)
PAD = POSE[:2]


class Desk:
    """An ingest with a filter of one drone among five anchors; the drone hovers at POSE and reports yaw 0.3."""

    def __init__(self) -> None:
        robot = RangedRobot(RADIO, PAD_YAW, math.radians(10), math.radians(1), PAD, 0.45)
        entities: dict[str, MotionModel] = {"drone": OdometryRobot(), "other": OdometryRobot()}
        links = {ranging_link("uwb", name, "drone"): place for name, place in PLACES.items()}
        entities |= {link: Anchor(place) for link, place in links.items()}
        sensors = {link: RangeSensor(link, RADIO, 9.0) for link in links}
        self.filter = FixedLagFilter(EstimatorParameters(entities, sensors, ranging={"uwb": {"drone": robot}}))
        self.intake, self.seq, self.now = Intake(self.filter, sensors, "here"), 0, START
        self.rng = np.random.default_rng(2)

    def header(self, entity: str) -> Header:
        self.seq += 1
        return Header(self.now, "here", entity, entity, self.seq)

    def status(self, state: FlightState) -> Verdict:
        return self.intake.take("s", VehicleStatus(header=self.header("drone"), flight_state=state, mode=""), self.now)

    def odometry(self, yaw: float = 0.3, reset: int = 0) -> Verdict:
        speed = (1e-6 * self.seq, 0.0, 0.0)
        message = Odometry(
            header=self.header("drone"), velocity_m_s=speed, velocity_covariance=(0.01,) * 9, yaw_rad=yaw,
            roll_rad=0.0, pitch_rad=0.0, height_m=POSE[2], reset=reset,
        )  # fmt: skip
        return self.intake.take("o", message, self.now)

    def round(self, at: tuple[float, float, float] = POSE, fix: bool = True, **changes: Any) -> RangeObservation:
        point = np.array(at) + rotation_z(PAD_YAW) @ np.array(RADIO)
        told = {name: math.dist(point, place) + 0.02 * self.rng.standard_normal() for name, place in PLACES.items()}
        message = RangeObservation(
            header=self.header("uwb"), observer="uwb", subject="drone", ranges_m=told, std_m=0.05,
            position_m=tuple(point.tolist()) if fix else None, covariance=tuple((0.01 * np.eye(3)).ravel().tolist()),
        )  # fmt: skip
        for name, value in changes.items():
            msgspec.structs.force_setattr(message, name, value)
        return message

    def take(self, message: RangeObservation) -> Verdict:
        return self.intake.take("range/uwb", message, self.now)

    def fly(self, rounds: int, **how: Any) -> None:
        """Feed odometry at 50 Hz and ranges at 10 Hz."""
        for _ in range(rounds):
            for _ in range(5):
                self.now += 20 * MS
                self.odometry()
            self.take(self.round(**how))
            self.filter.advance(self.now)

    def take_off(self) -> None:
        self.status(FlightState.LANDED)
        self.odometry()
        self.status(FlightState.FLYING)
        self.filter.advance(self.now)

    def land(self) -> None:
        self.status(FlightState.LANDED)
        self.now += 20 * MS
        self.odometry()
        self.filter.advance(self.now)


@pytest.fixture
def desk() -> Desk:
    return Desk()


def pose(desk: Desk) -> np.ndarray:
    return desk.filter.belief().mean_of("drone")[:4]


def test_a_drone_joins_where_ranges_put_it_with_the_heading_of_its_pad(desk: Desk) -> None:
    desk.take_off()
    assert "drone" not in desk.filter.belief().layout
    desk.fly(1)
    assert np.allclose(pose(desk), [*POSE, PAD_YAW], atol=0.02)
    assert desk.filter.belief().covariance_of("drone")[3, 3] == pytest.approx(math.radians(10) ** 2, rel=0.1)
    assert desk.intake.ranges.take_joined() == [("uwb", "drone", False)]
    before = desk.filter.belief().covariance_of("drone")[0, 0]
    desk.fly(20)
    assert desk.filter.belief().covariance_of("drone")[0, 0] < 0.5 * before
    assert np.allclose(pose(desk)[:3], POSE, atol=0.06) and desk.filter.age_s("drone") < 0.2


def test_standing_robots_are_not_initialised_by_ranges(desk: Desk) -> None:
    desk.status(FlightState.LANDED)
    desk.fly(2)
    assert "drone" not in desk.filter.belief().layout
    assert {one.reason for one in desk.filter.take_corrections()} == {"the subject does not fly"}


def test_the_initial_heading_follows_turns_on_the_pad_and_in_the_air(
    desk: Desk,
) -> None:
    desk.take_off()
    desk.odometry(yaw=0.3 + 1.0)
    desk.take(desk.round())
    desk.filter.advance(desk.now)
    assert pose(desk)[3] == pytest.approx(PAD_YAW + 1.0, abs=0.01)


def test_a_heading_that_jumped_in_the_air_is_unknown(desk: Desk) -> None:
    desk.take_off()
    desk.odometry(yaw=2.0, reset=1)
    desk.take(desk.round())
    desk.filter.advance(desk.now)
    assert "drone" not in desk.filter.belief().layout
    assert {one.verdict for one in desk.filter.take_corrections()} == {Verdict.AMBIGUOUS}


def test_the_pads_heading_is_not_that_of_a_robot_that_never_stood(desk: Desk) -> None:
    """A tracker that starts in flight hears odometry before the first status."""
    desk.odometry()
    desk.status(FlightState.FLYING)
    desk.filter.advance(desk.now)
    desk.fly(3)
    assert "drone" not in desk.filter.belief().layout
    assert {one.verdict for one in desk.filter.take_corrections()} == {Verdict.AMBIGUOUS}


def lifts_off_turned(desk: Desk) -> None:
    """Let it fly with another heading of its own, and be measured once."""
    desk.now += 20 * MS
    desk.odometry(yaw=-2.0, reset=1)
    desk.status(FlightState.FLYING)
    desk.filter.advance(desk.now)
    desk.take(desk.round())
    desk.filter.advance(desk.now)


def test_a_heading_that_jumps_at_the_next_take_off_is_the_same_as_before_the_jump(desk: Desk) -> None:
    """AR.Drones fuse their magnetometer in at each lift-off."""
    desk.take_off()
    desk.fly(3)
    desk.land()
    desk.status(FlightState.TAKING_OFF)
    lifts_off_turned(desk)
    assert pose(desk)[3] == pytest.approx(PAD_YAW, abs=0.05)


@pytest.mark.parametrize(("aside_m", "joins"), [(0.1, True), (0.8, False)])
def test_with_a_new_battery_the_heading_is_the_pads_again_if_ranges_find_it_there(
    desk: Desk, aside_m: float, joins: bool
) -> None:
    desk.take_off()
    desk.fly(3)
    desk.land()
    desk.now += 60_000 * MS
    desk.odometry(yaw=-2.0, reset=1)
    desk.take(desk.round(at=(PAD[0] + aside_m, PAD[1], 0.0)))
    lifts_off_turned(desk)
    assert ("drone" in desk.filter.belief().layout) == joins
    if joins:
        assert pose(desk)[3] == pytest.approx(PAD_YAW, abs=0.01)


def test_ranges_without_a_place_let_nobody_join(desk: Desk) -> None:
    desk.take_off()
    desk.fly(3, fix=False)
    assert "drone" not in desk.filter.belief().layout


def test_one_who_is_elsewhere_round_after_round_is_placed_anew(desk: Desk) -> None:
    desk.take_off()
    desk.fly(10)
    desk.intake.ranges.take_joined()
    away = (POSE[0] - 1.5, POSE[1], POSE[2])
    desk.fly(4, at=away)
    assert pose(desk)[0] > POSE[0] - 0.75
    desk.fly(6, at=away)
    assert np.allclose(pose(desk)[:3], away, atol=0.1)
    assert desk.intake.ranges.take_joined() == [("uwb", "drone", True)]


def test_contradictions_long_ago_are_not_held_against_a_robot(desk: Desk) -> None:
    desk.take_off()
    desk.fly(10)
    desk.intake.ranges.take_joined()
    away = (POSE[0] - 1.5, POSE[1], POSE[2])
    desk.fly(4, at=away)
    desk.fly(60, fix=False)
    desk.fly(1, at=away)
    assert desk.intake.ranges.take_joined() == []
    assert pose(desk)[0] > POSE[0] - 0.75


@pytest.mark.parametrize(("age_ms", "verdict"), [(3000, Verdict.LATE), (-3000, Verdict.IMPLAUSIBLE)])
def test_rounds_of_another_time_place_nobody(desk: Desk, age_ms: int, verdict: Verdict) -> None:
    desk.take_off()
    told = desk.round()
    header = msgspec.structs.replace(told.header, stamp_ns=desk.now - age_ms * MS)
    assert desk.take(msgspec.structs.replace(told, header=header)) is verdict
    desk.filter.advance(desk.now)
    assert "drone" not in desk.filter.belief().layout
    desk.fly(10)
    rounds = [desk.round(at=(POSE[0] - 1.5, POSE[1], POSE[2])) for _ in range(10)]
    for k, told in enumerate(rounds):  # a link that stalled delivers all of them at once
        header = msgspec.structs.replace(told.header, stamp_ns=desk.now - age_ms * MS + 100 * k * MS)
        assert desk.take(msgspec.structs.replace(told, header=header)) is verdict
    desk.filter.advance(desk.now)
    assert pose(desk)[0] > POSE[0] - 0.1


def test_a_reflection_moves_nobody(desk: Desk) -> None:
    desk.take_off()
    desk.fly(20)
    before = pose(desk)
    told = desk.round(fix=False)
    desk.take(msgspec.structs.replace(told, ranges_m=told.ranges_m | {"a": told.ranges_m["a"] + 1.5}))
    desk.filter.advance(desk.now)
    assert math.dist(pose(desk)[:3], before[:3]) < 0.03
    refused = [one for one in desk.filter.take_corrections() if one.observer == "uwb_a_drone"][-1]
    assert refused.verdict is Verdict.IMPLAUSIBLE and refused.nis is not None and refused.nis > 50.0


def test_the_order_of_arrival_does_not_matter() -> None:
    ends = []
    for swapped in (False, True):
        desk = Desk()
        desk.take_off()
        desk.fly(5)
        desk.now += 20 * MS
        first, desk.now = desk.round(), desk.now + 20 * MS
        second = desk.round(at=(POSE[0] + 0.02, POSE[1], POSE[2]))
        desk.now += 20 * MS
        for told in (second, first) if swapped else (first, second):
            assert desk.take(told) is Verdict.ACCEPTED
        desk.filter.advance(desk.now)
        ends.append(desk.filter.belief())
    assert np.array_equal(ends[0].mean, ends[1].mean) and np.array_equal(ends[0].covariance, ends[1].covariance)


@pytest.mark.parametrize(
    ("changes", "verdict"),
    [
        ({"std_m": 0.0}, Verdict.IMPLAUSIBLE),
        ({"std_m": math.nan}, Verdict.IMPLAUSIBLE),
        ({"ranges_m": {"a": math.inf}}, Verdict.IMPLAUSIBLE),
        ({"position_m": (0.0, math.nan, 0.0)}, Verdict.IMPLAUSIBLE),
        ({"position_m": (0.0, 0.0)}, Verdict.SINGULAR),
        ({"covariance": (0.0,) * 9}, Verdict.SINGULAR),
        ({"observer": "gps"}, Verdict.UNKNOWN_ENTITY),
        ({"subject": "other"}, Verdict.UNKNOWN_ENTITY),
        ({"ranges_m": {"z": 2.0}, "position_m": None}, Verdict.UNKNOWN_ENTITY),
    ],
)
def test_an_unusable_round_is_refused_by_name(desk: Desk, changes: dict[str, Any], verdict: Verdict) -> None:
    desk.take_off()
    assert desk.take(desk.round(**changes)) is verdict
    desk.filter.advance(desk.now)
    assert "drone" not in desk.filter.belief().layout


def test_a_stream_that_repeats_itself_is_frozen(desk: Desk) -> None:
    desk.take_off()
    told, verdicts = desk.round(), []
    for _ in range(6):
        desk.now += 100 * MS
        desk.odometry()
        verdicts.append(desk.take(msgspec.structs.replace(told, header=desk.header("uwb"))))
    assert verdicts[:2] == [Verdict.ACCEPTED, Verdict.DUPLICATE] and verdicts[-1] is Verdict.FROZEN
