"""The planning cost of one topology, minimised by the projected L-BFGS that both planners share."""

import numpy as np

from groundstation.arrays import Vector
from groundstation.experiments.planar.objective import cost_and_gradient
from groundstation.experiments.planar.records import Limits, PlanarProblem, Workspace
from groundstation.kernel import kernel
from groundstation.planning.lbfgs import descent_from, take

ENDED, OUT_OF_BUDGET, FAILED = 0, 1, 2


@kernel()
def minimise(
    x: Vector, problem: PlanarProblem, work: Workspace, scale: float, limits: Limits
) -> tuple[float, int, int]:
    """Minimise cost / scale of the workspace's topology from x, in place; scale 0 stands for the cost at x.

    Returns (cost [m^2], evaluations, status); ENDED when max |clip(x - g) - x| <= tolerance, or no step helps.
    """
    descent = descent_from(x, scale)
    progress, status = descent.progress[0], ENDED
    while progress.over == 0:
        if progress.evaluations > 0 and (progress.evaluations >= limits.budget or limits.stop[0] != 0):
            status = OUT_OF_BUDGET
            break
        value = cost_and_gradient(descent.trial, problem, work, descent.trial_gradient)
        take(descent, value if value >= 0.0 else np.inf, limits.tolerance, 0.0)
    for k in range(x.shape[0]):
        x[k] = descent.x[k]
    cost, evaluations = progress.cost, progress.evaluations
    return cost, evaluations, status if np.isfinite(cost) else FAILED
