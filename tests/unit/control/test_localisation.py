"""Whether an entity is known well enough to fly on, queried many times of one belief."""

from pathlib import Path

import numpy as np

from groundstation.control.parameters import safety_from_field
from groundstation.control.view import Localisation
from groundstation.estimation.belief import JointBelief
from groundstation.estimation.layout import ROBOT_CORE, EntityKind, StateLayout
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
