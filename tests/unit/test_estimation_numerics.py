"""The covariance stays symmetric and positive definite, whatever the ratio of prior to measurement."""

import numpy as np
import pytest

from groundstation.estimation.correction import apply, bound_precision, project, project_columns, surprise
from groundstation.estimation.models.height import correct_height


def correct(P, R, H, y):
    """One dense correction through the compiled kernels: all states as block a."""
    rows, n = H.shape
    mean, W, HPH = np.zeros(n), np.zeros((4, n)), np.empty((rows, rows))
    nothing, factor = np.zeros((rows, n)), np.zeros((rows, rows))
    H = np.ascontiguousarray(H)
    project(P, 0, n, H, 0, 0, nothing, rows, W)
    project_columns(W[:rows], 0, n, H, 0, 0, nothing, rows, HPH)
    bound_precision(HPH, R, rows)
    nis = surprise(HPH, R, y, rows, factor)
    apply(mean, P, rows, W, 0.5 * (HPH + HPH.T) + R, factor, y)
    return mean, nis


def test_a_correction_is_that_of_the_textbook() -> None:
    rng = np.random.default_rng(2)
    root = rng.normal(size=(9, 9))
    P, H, R, y = root @ root.T, rng.normal(size=(4, 9)), np.diag([0.1, 0.2, 0.3, 0.4]), rng.normal(size=4)
    S = H @ P @ H.T + R
    K = np.linalg.solve(S, H @ P).T
    expected = P - K @ S @ K.T
    corrected = P.copy()
    mean, nis = correct(corrected, R.copy(), H, y)
    np.testing.assert_allclose(mean, K @ y, rtol=1e-7)
    np.testing.assert_allclose(corrected, expected, atol=1e-7)
    assert nis == pytest.approx(y @ np.linalg.solve(S, y), rel=1e-7)


@pytest.mark.parametrize("prior", [1e-9, 1e-4, 1.0, 1e3, 1e6])
@pytest.mark.parametrize("noise", [1e-9, 1e-6, 1e-4, 1.0, 1e4])
def test_covariance_stays_positive_definite(prior: float, noise: float) -> None:
    rng = np.random.default_rng(3)
    P, R = prior * np.eye(6), noise * np.eye(3)
    for _ in range(200):
        H = rng.normal(size=(3, 6))
        correct(P, R.copy(), H, np.zeros(3))
        P += 1e-12 * np.eye(6)
        assert np.array_equal(P, P.T)
        np.linalg.cholesky(P)


def test_a_height_is_corrected_like_any_other_measurement() -> None:
    rng = np.random.default_rng(5)
    root = rng.normal(size=(6, 6))
    P = root @ root.T
    expected, other, mean = P.copy(), P.copy(), np.zeros(6)
    H = np.zeros((1, 6))
    H[0, [1, 4, 5]] = 1.0, 1.0, -1.0
    reference, _ = correct(expected, np.array([[0.3]]), H, np.array([0.7]))
    correct_height(mean, other, 1, 4, 5, 0.7, 0.3, 1e9)
    np.testing.assert_allclose(other, expected, atol=1e-9)
    np.testing.assert_allclose(mean, reference, atol=1e-9)


def test_a_soft_gate_bounds_the_pull_of_an_outlier() -> None:
    P, mean = np.eye(2), np.zeros(2)
    correct_height(mean, P, 0, 1, -1, 1000.0, 0.1, 9.0)
    assert 0.0 < mean.sum() < 1.0
    np.linalg.cholesky(P)
