"""Eliminates the knots of all paths from the normal equations, which are banded in time."""

from dataclasses import dataclass

import numpy as np
from scipy.linalg import cho_solve_banded, cholesky_banded
from scipy.sparse import csr_matrix

from groundstation.arrays import Array, Vector


@dataclass(frozen=True, slots=True)
class Knots:
    """The data from which the knots follow once the figures are known."""

    own: Vector
    by_figures: Array

    def step(self, figures: Vector) -> Vector:
        """Return the step of all knots that goes with a step of the figures."""
        return np.asarray(self.own - self.by_figures @ figures)


def eliminated(r: Vector, local: csr_matrix, figures: csr_matrix, band: int) -> tuple[Array, Vector, Knots]:
    """Return information and pull of the figures with all knots eliminated, and the data to find the knots again."""
    H = (local.T @ local).tocoo()
    count = H.shape[0]
    banded = np.zeros((band + 1, count))
    upper = H.col >= H.row
    banded[band + H.row[upper] - H.col[upper], H.col[upper]] = H.data[upper]
    banded[band] += 1e-9
    cross = np.asarray((local.T @ figures).todense())
    factor = (cholesky_banded(banded), False)
    by_figures = cho_solve_banded(factor, cross)
    own = cho_solve_banded(factor, local.T @ r)
    information = np.asarray((figures.T @ figures).todense()) - cross.T @ by_figures
    return 0.5 * (information + information.T), figures.T @ r - cross.T @ own, Knots(own, by_figures)
