"""The covariance stays symmetric and positive definite, whatever the ratio of prior to measurement."""

import re
from pathlib import Path

import numpy as np
import pytest

from groundstation.arrays import Matrix, Vector
from groundstation.estimation import correction
from groundstation.estimation.correction import Touched, apply, bound_precision, project, project_columns, surprise
from groundstation.estimation.linear import cholesky
from groundstation.estimation.models.height import HeightEntries, correct_height
from groundstation.kernel import kernel


def correct(P, R, H, y):
    """One dense correction through the compiled kernels: all states as block a."""
    rows, n = H.shape
    mean, W, HPH = np.zeros(n), np.zeros((4, n)), np.empty((rows, rows))
    everything, nothing = Touched(0, n, np.ascontiguousarray(H)), Touched(0, 0, np.zeros((rows, n)))
    factor = np.zeros((rows, rows))
    project(P, everything, nothing, rows, W)
    project_columns(W[:rows], everything, nothing, rows, HPH)
    bound_precision(HPH, R, rows)
    nis = surprise(HPH, R, y, rows, factor)
    apply(mean, P, rows, W, factor, y)
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
    correct_height(mean, other, HeightEntries(1, 4, 5), 0.7, 0.3, 1e9)
    np.testing.assert_allclose(other, expected, atol=1e-9)
    np.testing.assert_allclose(mean, reference, atol=1e-9)


def test_a_soft_gate_bounds_the_pull_of_an_outlier() -> None:
    P, mean = np.eye(2), np.zeros(2)
    correct_height(mean, P, HeightEntries(0, 1, -1), 1000.0, 0.1, 9.0)
    assert 0.0 < mean.sum() < 1.0
    np.linalg.cholesky(P)


@kernel()
def fly(mean: Vector, P: Matrix, F: Matrix, H: Matrix, R: Matrix, steps: int, worst: Vector) -> int:
    """Predict and correct a small state for many steps; returns the steps after which P was no covariance."""
    n, rows = P.shape[0], H.shape[0]
    W, S, factor, y, work = np.zeros((4, n)), np.zeros((4, 4)), np.zeros((4, 4)), np.zeros(4), np.zeros((n, n))
    noise, bad = np.zeros((4, 4)), 0
    for step in range(steps):
        for i in range(n):
            for j in range(n):
                work[i, j] = 0.0
                for k in range(n):
                    work[i, j] += F[i, k] * P[k, j]
        for i in range(n):
            for j in range(i + 1):
                value = 0.0
                for k in range(n):
                    value += work[i, k] * F[j, k]
                P[i, j] = P[j, i] = value
        P[step % n, step % n] += 1e-9
        for i in range(rows):
            for j in range(n):
                W[i, j] = 0.0
                for k in range(n):
                    W[i, j] += H[i, k] * P[k, j]
        for i in range(rows):
            for k in range(rows):
                S[i, k] = 0.0
                for j in range(n):
                    S[i, k] += W[i, j] * H[k, j]
                noise[i, k] = R[i, k]
        bound_precision(S, noise, rows)
        surprise(S, noise, y, rows, factor)
        apply(mean, P, rows, W, factor, y)
        for i in range(n):
            for j in range(n):
                work[i, j] = P[i, j]
                worst[0] = max(worst[0], abs(P[i, j] - P[j, i]))
        bad += not cholesky(work, n)
    return bad


def long_flight(prior: float, noise: float, steps: int) -> tuple[int, float]:
    n = 4
    F = np.eye(n)
    F[0, 2] = F[1, 3] = 0.01
    H = np.array([[1.0, 0.3, 0.0, 0.0], [0.2, -1.0, 0.0, 0.1]])
    worst = np.zeros(1)
    bad = fly(np.zeros(n), prior * np.eye(n), F, H, noise * np.eye(2), steps, worst)
    return int(bad), float(worst[0])


@pytest.mark.parametrize("prior", [1e-9, 1.0, 1e6])
@pytest.mark.parametrize("noise", [1e-9, 1e-4])
def test_a_million_steps_leave_a_covariance(prior: float, noise: float) -> None:
    assert long_flight(prior, noise, 1_000_000) == (0, 0.0)


@pytest.mark.slow
@pytest.mark.study
@pytest.mark.timeout(300)
def test_ten_million_steps_leave_a_covariance() -> None:
    assert long_flight(1e6, 1e-6, 10_000_000) == (0, 0.0)


def test_nothing_is_inverted() -> None:
    package = Path(correction.__file__).parent
    assert not [p.name for p in package.rglob("*.py") if re.search(r"\binv\(|linalg", p.read_text(encoding="utf-8"))]


@pytest.mark.parametrize("dim", [3, 4, 5, 6, 7, 8, 13])
def test_a_state_of_any_size_is_corrected(dim: int) -> None:
    """Rows of P are worked off four at a time; what is left over is no less corrected."""
    rng = np.random.default_rng(dim)
    root = rng.normal(size=(dim, dim))
    P, H, R, y = root @ root.T, rng.normal(size=(3, dim)), 0.1 * np.eye(3), rng.normal(size=3)
    S = H @ P @ H.T + R
    K = np.linalg.solve(S, H @ P).T
    corrected = P.copy()
    mean, _ = correct(corrected, R.copy(), H, y)
    np.testing.assert_allclose(corrected, P - K @ S @ K.T, atol=1e-7)
    np.testing.assert_allclose(mean, K @ y, atol=1e-7)
    assert np.array_equal(corrected, corrected.T)
