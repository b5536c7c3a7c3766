"""Whether an entity is known well enough to fly on: by one rule for all, queried many times of one belief."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from groundstation.control.flight_mode import FlightMode
from groundstation.control.output_limiter import limit_setpoint
from groundstation.control.parameters import safety_from_field
from groundstation.control.setpoints import Setpoint
from groundstation.control.view import Localisation
from groundstation.estimation.belief import JointBelief
from groundstation.estimation.layout import ROBOT_CORE, TARGET_CORE, EntityKind, StateLayout
from groundstation.settings.load import load_field
from groundstation.settings.resolved import resolved_field

SAFETY = safety_from_field(resolved_field(load_field(Path(__file__).parents[3] / "config/lab.yaml")))
LABELS = (*ROBOT_CORE, "velocity_bias_x", "velocity_bias_y")


def belief(position_std_m: float, velocity_bias_m_s: float = 0.0) -> JointBelief:
    layout = StateLayout().with_entity("drone_1", EntityKind.ROBOT, LABELS)
    mean = np.array([*(0.0 for _ in ROBOT_CORE), velocity_bias_m_s, 0.0])
    return JointBelief(mean, np.diag([position_std_m**2] * layout.dim), layout, 1)


def test_each_belief_and_each_time_out_of_sight_is_judged_for_itself() -> None:
    localisation, lies = Localisation(SAFETY), 2.0 * SAFETY.max_known_velocity_error_m_s
    good, poor, false = belief(0.05), belief(2.0 * SAFETY.max_position_std_m), belief(0.05, lies)
    for _ in range(2):
        assert localisation.holds(good, "drone_1", 0.1)
        assert not localisation.holds(poor, "drone_1", 0.1)
        assert localisation.holds(false, "drone_1", 0.1)
        assert not localisation.holds(false, "drone_1", 2.0)
        assert localisation.holds(false, "drone_1", 0.1)


@pytest.mark.parametrize("axis", range(3))
@pytest.mark.parametrize(("share", "known"), [(0.99, True), (1.01, False)])
def test_whom_the_limiter_stops_for_its_place_is_not_localised(axis: int, share: float, known: bool) -> None:
    """Else it would hover for ever, its height unknown: only a robot that is not localised lands or flies back."""
    variances = np.full(len(LABELS), 0.05**2)
    variances[axis] = (share * SAFETY.max_position_std_m) ** 2
    at, fly = replace(belief(0.05), covariance=np.diag(variances)), Setpoint((0.1, 0.0, 0.0), 0.0, FlightMode.TRACK)
    assert Localisation(SAFETY).holds(at, "drone_1", 0.0) == known
    assert ("uncertain" in limit_setpoint("drone_1", fly, at, at.stamp_ns, SAFETY).limited_by) != known


def test_the_speed_of_a_target_need_not_be_known() -> None:
    layout = StateLayout().with_entity("turtlebot", EntityKind.TARGET, TARGET_CORE)
    at = JointBelief(np.zeros(4), np.diag([0.01, 0.01, 4.0, 4.0]), layout, 1)
    assert Localisation(SAFETY).holds(at, "turtlebot", 0.0)
