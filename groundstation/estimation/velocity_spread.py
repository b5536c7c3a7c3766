"""Covariance of a robot's velocity, by the belief."""

import numpy as np

from groundstation.arrays import Array
from groundstation.estimation.fixed_lag import FixedLagFilter


def robot_velocity_covariance(joint: FixedLagFilter, robot: str, covariance: Array) -> Array | None:
    """Return the covariance (3, 3) of a robot's velocity [m^2/s^2] ahead along its heading, to its left, and up.

    covariance: of its block. To the errors that are states it adds the quick error of the reported velocity, if the
    model has one (`velocity_std_m_s`). The error of its heading is none of a velocity along its own axes. None: its
    model does not tell how its velocity errs.
    """
    model, memory = joint.driven(robot)
    tell = getattr(model, "velocity_errors", None)
    if tell is None:
        return None
    changes = tell(memory)
    wrong = [model.labels.index(label) for label in changes]
    J = np.array(list(changes.values())).reshape(-1, 3)
    found = J.T @ covariance[np.ix_(wrong, wrong)] @ J
    quick = getattr(model, "velocity_std_m_s", 0.0) ** 2
    found[0, 0] += quick
    found[1, 1] += quick
    return np.asarray((found + found.T) / 2)
