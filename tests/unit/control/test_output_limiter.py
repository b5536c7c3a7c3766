"""A robot must hover if its belief is too old, from the future, or too uncertain."""

import math

import numpy as np
import pytest

from groundstation.control.flight_mode import FlightMode
from groundstation.control.output_limiter import Limited, limit_setpoint
from groundstation.control.parameters import SafetyParameters
from groundstation.control.setpoints import Setpoint
from groundstation.estimation.belief import JointBelief
from groundstation.estimation.layout import ROBOT_CORE, EntityKind, StateLayout

SAFETY = SafetyParameters(fence=((-3.7, 3.7), (-2.7, 2.7), (0.0, 2.8)))
LAYOUT = StateLayout().with_entity("a", EntityKind.ROBOT, ROBOT_CORE)
MS, STAMP_NS = 1_000_000, 1_000_000_000_000
MOST_AGE_MS = round(1000 * SAFETY.max_belief_age_s)
WANTED = (0.2, 0.1, 0.0)


def limited(
    age_ms: int = 0, variances: tuple[float, float, float] = (0.0009,) * 3, wanted: tuple[float, ...] = WANTED
) -> Limited:
    belief = JointBelief(np.array([0.0, 0.0, 1.4, 0.0]), np.diag([*variances, 0.01]), LAYOUT, STAMP_NS)
    setpoint = Setpoint((wanted[0], wanted[1], wanted[2]), 0.1, FlightMode.TRACK)
    return limit_setpoint("a", setpoint, belief, STAMP_NS + age_ms * MS, SAFETY)


@pytest.mark.parametrize(
    ("age_ms", "stale"),
    [(0, False), (MOST_AGE_MS // 2, False), (MOST_AGE_MS + 10, True), (-90, False), (-110, True)],
)
def test_a_belief_that_is_old_or_from_the_future_moves_nobody(age_ms: int, stale: bool) -> None:
    found = limited(age_ms)
    assert found.limited_by == (("stale",) if stale else ())
    assert found.setpoint.velocity_m_s == pytest.approx((0.0, 0.0, 0.0) if stale else WANTED)
    assert found.setpoint.yaw_rate_rad_s == (0.0 if stale else 0.1)


@pytest.mark.parametrize("axis", [0, 1, 2])
@pytest.mark.parametrize(("factor", "uncertain"), [(0.99, False), (1.01, True)])
def test_a_robot_uncertain_along_any_axis_hovers(axis: int, factor: float, uncertain: bool) -> None:
    variances = [0.0009] * 3
    variances[axis] = factor * SAFETY.max_position_std_m**2
    found = limited(variances=(variances[0], variances[1], variances[2]))
    assert found.limited_by == (("uncertain",) if uncertain else ())


def test_a_covariance_that_is_none_moves_nobody() -> None:
    assert limited(variances=(0.0009, -1e-6, 0.0009)).limited_by == ("uncertain",)


def test_the_wanted_velocity_of_a_limited_robot_is_kept_if_finite() -> None:
    assert limited(MOST_AGE_MS + 10).wanted_m_s == WANTED
    broken = limited(wanted=(math.nan, 0.0, 0.0))
    assert broken.limited_by == ("not finite",) and broken.wanted_m_s is None
