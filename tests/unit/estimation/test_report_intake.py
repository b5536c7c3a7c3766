"""A target's report of its own motion: its use in the filter, its limits, and the rejection of a wrong one."""

import math
from collections.abc import Callable

import numpy as np
import pytest

from groundstation.bus.messages import Header, RelativeObservation, ReportedMotion, Severity, Verdict
from groundstation.estimation.fixed_lag import FixedLagFilter
from groundstation.estimation.ingest import Intake
from groundstation.estimation.measurement import Correction
from groundstation.estimation.models import ConstantVelocityTarget, FixedMount, MountedCamera, ReportedVelocity
from groundstation.estimation.models.protocol import MotionModel, ObservationModel
from groundstation.estimation.parameters import WORLD_FROM_DOWN, EstimatorParameters

MS = 1_000_000
START = 7_000_000 * MS
UP_M, STD_M, SPEED_STD = 4.0, 0.02, 0.05
Says = Callable[[float], float]  # its reported velocity [m/s], by its true speed


class Desk:
    """A target under a camera that sees it ten times a second; it drives a circle, at `speed` from `starts_s` on."""

    def __init__(self, heading: bool = False) -> None:
        entities: dict[str, MotionModel] = {
            "cart": ConstantVelocityTarget(0.0, 0.32, heading=heading),
            "eye": FixedMount((0.0, 0.0, UP_M), 0.001, 0.003),
        }
        sensors: dict[str, ObservationModel] = {
            "eye": MountedCamera("eye", WORLD_FROM_DOWN),
            "cart_odometry": ReportedVelocity("cart"),
        }
        self.filter = FixedLagFilter(EstimatorParameters(entities, sensors, reporting=frozenset({"cart"})))
        self.intake = Intake(self.filter, sensors, "here")
        self.rng, self.now, self.seq = np.random.default_rng(3), START, 0
        self.place, self.yaw, self.speed, self.errors = np.zeros(2), 0.4, 0.0, list[float]()
        self.outcomes: list[Correction] = []

    def header(self, entity: str) -> Header:
        self.seq += 1
        return Header(self.now, "here", entity, entity, self.seq)

    def see(self) -> None:
        offset = np.array([*self.place, 0.0]) - (0.0, 0.0, UP_M) + STD_M * self.rng.standard_normal(3)
        sighting = RelativeObservation(
            header=self.header("eye"), observer="eye", subject="cart", camera="eye", yaw_rad=None,
            position_m=tuple((WORLD_FROM_DOWN.T @ offset).tolist()),
            covariance=tuple((STD_M**2 * np.eye(3)).ravel().tolist()),
        )  # fmt: skip
        assert self.intake.take("observation/eye", sighting, self.now) is Verdict.ACCEPTED

    def report(self, speed: float, std: float = SPEED_STD) -> Verdict:
        message = ReportedMotion(header=self.header("cart"), velocity_m_s=(speed, 0.0), std_m_s=std)
        return self.intake.take("reported_motion/cart", message, self.now)

    def drive(self, seconds: float, says: Says | None = None, seen: bool = True, turn: float = 0.3) -> None:
        """Drive on; says: None for a silent one."""
        for step in range(round(seconds / 0.05)):
            self.now += 50 * MS
            self.yaw += 0.05 * turn
            self.place += 0.05 * self.speed * np.array([math.cos(self.yaw), math.sin(self.yaw)])
            if seen and step % 2 == 0:
                self.see()
            if says is not None:
                self.report(says(self.speed))
            self.filter.advance(self.now)
            outcomes = self.filter.take_corrections()
            self.outcomes += outcomes
            self.intake.reports.advance(self.now, outcomes)
            self.errors.append(math.dist(self.filter.belief().mean_of("cart")[:2], self.place))

    @property
    def told(self) -> list[str]:
        return [str(notice.severity) for notice in self.intake.reports.take_notices()]

    @property
    def spread(self) -> float:
        """Return the standard deviation of the velocity [m/s], both axes together."""
        return math.sqrt(np.trace(self.filter.belief().covariance_of("cart")[2:4, 2:4]))

    def rms(self, seconds: float) -> float:
        return float(np.sqrt(np.mean(np.square(self.errors[-round(seconds / 0.05) :]))))


@pytest.fixture
def desk() -> Desk:
    desk = Desk()
    desk.drive(2.0)
    return desk


def truly(speed: float) -> float:
    return speed


def test_an_honest_report_makes_the_velocity_surer_and_is_believed(desk: Desk) -> None:
    desk.speed = 0.4
    desk.drive(5.0)
    alone = desk.spread
    desk.drive(20.0, truly)
    assert desk.spread < 0.85 * alone and desk.rms(15.0) < 0.025
    assert desk.intake.reports.heeds("cart") and desk.told == []


def test_a_reported_standstill_reduces_velocity_uncertainty_in_both_axes(desk: Desk) -> None:
    alone = desk.spread
    desk.drive(2.0, truly)
    assert desk.spread < 0.6 * alone
    assert np.allclose(desk.filter.belief().mean_of("cart")[2:4], 0.0, atol=0.05)


def test_with_a_heading_the_velocity_lies_along_it() -> None:
    desk = Desk(heading=True)
    desk.filter.place("cart", (0.0, 0.0, 0.0, 0.4), (1e-4,) * 4, START, START)
    for _ in range(20):
        desk.now += 50 * MS
        desk.report(0.3)
        desk.filter.advance(desk.now)
    assert desk.filter.belief().mean_of("cart")[2:4] == pytest.approx(
        (0.3 * math.cos(0.4), 0.3 * math.sin(0.4)), abs=0.03
    )


def test_a_report_is_no_sighting(desk: Desk) -> None:
    desk.drive(3.0, truly, seen=False)
    assert desk.filter.age_s("cart") == pytest.approx(3.1, abs=0.06)


def test_without_sightings_it_counts_for_a_second_only(desk: Desk) -> None:
    desk.drive(0.9, truly, seen=False)
    held = desk.spread
    desk.drive(2.0, truly, seen=False)
    assert desk.spread > 2.0 * held


def test_a_target_that_lies_moves_nobody_else(desk: Desk) -> None:
    """Observations of the target also determine the camera's mounting; the report does not change it by a bit."""
    desk.speed = 0.4
    desk.drive(3.0)
    before = desk.filter.belief()
    for _ in range(3):
        desk.report(0.5, std=0.2)
    desk.filter.advance(desk.now)
    after = desk.filter.belief()
    assert not np.array_equal(before.mean_of("cart"), after.mean_of("cart"))
    assert np.array_equal(before.mean_of("eye"), after.mean_of("eye"))
    assert np.array_equal(before.covariance_of("eye"), after.covariance_of("eye"))
    P = after.covariance
    assert np.array_equal(P, P.T) and np.linalg.eigvalsh(P)[0] > 0.0


@pytest.mark.parametrize("says", [lambda v: 0.0, lambda v: 0.5 * v, lambda v: 1.5 * v, lambda v: v + 0.3])
def test_a_wrong_one_is_dropped_and_told_once_and_the_cameras_win(desk: Desk, says: Says) -> None:
    """Wheels that are stuck, of another radius, that slip; the target starts to move under a wrong report."""
    desk.drive(2.0, says)
    for speed in np.linspace(0.0, 0.4, 17):
        desk.speed = float(speed)
        desk.drive(0.05, says)
    desk.drive(3.0, says)
    assert not desk.intake.reports.heeds("cart") and desk.told == [Severity.WARNING]
    desk.drive(5.0, says)
    assert desk.rms(4.0) < 0.03 and max(desk.errors[40:]) < 0.3 and desk.told == []


def test_a_misread_marker_contradicts_no_report(desk: Desk) -> None:
    desk.speed = 0.3
    for away_m in (0.5, -1.0, 2.0):
        desk.drive(3.0, truly)
        desk.place[0] += away_m
        desk.see()
        desk.place[0] -= away_m
        desk.filter.advance(desk.now)
        (refused,) = [one for one in desk.filter.take_corrections() if not one.is_report]
        assert refused.verdict is Verdict.IMPLAUSIBLE and math.hypot(*refused.ahead) > 10.0
        desk.intake.reports.advance(desk.now, [refused])
        assert desk.intake.reports.heeds("cart")
    assert desk.told == []


def test_one_that_comes_right_is_used_again_and_later_each_time(desk: Desk) -> None:
    desk.speed, waits = 0.4, []
    desk.drive(2.0)
    for _ in range(3):
        while desk.intake.reports.heeds("cart"):
            desk.drive(0.5, lambda v: 0.0)
        since = desk.now
        while not desk.intake.reports.heeds("cart"):
            desk.drive(0.25, truly)
            assert desk.now - since < 20_000 * MS
        waits.append((desk.now - since) / 1e9)
    assert desk.told == [Severity.WARNING, Severity.INFO] * 3
    assert 2.0 <= waits[0] < 3.5 and 4.0 <= waits[1] < 6.5 and 8.0 <= waits[2] < 12.0


def test_implausible_late_or_unknown_motion_reports_are_refused(desk: Desk) -> None:
    assert desk.report(2000.0) is Verdict.IMPLAUSIBLE and desk.report(0.1, std=0.0) is Verdict.IMPLAUSIBLE
    late = ReportedMotion(
        header=Header(desk.now - 700 * MS, "here", "cart", "cart", 9999), velocity_m_s=(0.0, 0.0), std_m_s=0.05
    )
    assert desk.intake.take("reported_motion/cart", late, desk.now) is Verdict.LATE
    stranger = ReportedMotion(header=desk.header("rover"), velocity_m_s=(0.0, 0.0), std_m_s=0.05)
    assert desk.intake.take("reported_motion/rover", stranger, desk.now) is Verdict.UNKNOWN_ENTITY


def test_the_order_of_arrival_does_not_matter() -> None:
    beliefs = []
    for swapped in (False, True):
        desk = Desk()
        desk.drive(2.0)
        for what in ("report", "see") if swapped else ("see", "report"):
            desk.seq, desk.rng = 1000 + len(what), np.random.default_rng(5)
            if what == "see":
                desk.see()
            else:
                desk.report(0.02)
        desk.filter.advance(desk.now + 20 * MS)
        beliefs.append(desk.filter.belief())
    assert np.array_equal(beliefs[0].mean, beliefs[1].mean)
    assert np.array_equal(beliefs[0].covariance, beliefs[1].covariance)
