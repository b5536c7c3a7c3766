"""An odometry that erred is expected to err again for some seconds."""

import numpy as np
import pytest

from groundstation.control.odometry_errors import OdometryErrors
from groundstation.estimation.belief import JointBelief
from groundstation.estimation.layout import ROBOT_CORE, EntityKind, StateLayout

LABELS = (*ROBOT_CORE, "velocity_bias_x", "velocity_bias_y")
STD_M_S = 0.03


def belief(at_s: float, error_m_s: float, names: tuple[str, ...] = ("drone_1",)) -> JointBelief:
    layout = StateLayout()
    for name in names:
        layout = layout.with_entity(name, EntityKind.ROBOT, LABELS)
    mean = np.tile([0.0, 0.0, 1.5, 0.0, error_m_s, 0.0], len(names))
    return JointBelief(mean, STD_M_S**2 * np.eye(layout.dim), layout, round(at_s * 1e9))


def test_an_error_that_passes_zero_is_expected_to_come_back() -> None:
    errors = OdometryErrors()
    assert errors.advance(belief(1.0, 0.4))["drone_1"] == pytest.approx(0.4, abs=0.01)
    assert errors.advance(belief(2.0, 0.0))["drone_1"] == pytest.approx(0.4 * np.exp(-0.1))
    assert errors.advance(belief(3.0, -0.5))["drone_1"] == pytest.approx(0.5, abs=0.01)


def test_a_sound_odometry_is_expected_to_be_as_its_deviation_says() -> None:
    errors = OdometryErrors()
    assert errors.advance(belief(1.0, 0.0))["drone_1"] == pytest.approx(STD_M_S)
    errors.advance(belief(2.0, 0.4))
    assert errors.advance(belief(60.0, 0.0))["drone_1"] == pytest.approx(STD_M_S)


def test_a_robot_that_left_the_belief_starts_without_error() -> None:
    errors = OdometryErrors()
    errors.advance(belief(1.0, 0.4))
    assert errors.advance(belief(1.1, 0.0, ())) == {}
    assert errors.advance(belief(1.2, 0.0))["drone_1"] == pytest.approx(STD_M_S)
