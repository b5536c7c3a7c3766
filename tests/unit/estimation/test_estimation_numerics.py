"""The covariance stays symmetric and positive definite, whatever the ratio of prior to measurement."""

import re
from pathlib import Path

import numpy as np
import pytest

from groundstation.arrays import Matrix, Vector
from groundstation.estimation import correction
from groundstation.estimation.correction import Jacobian, apply, bound_precision, measured_covariance, project, surprise
from groundstation.estimation.deferred import MOST, make, variance_of
from groundstation.estimation.filter_state import Belief, Deferred
from groundstation.estimation.linear import cholesky
from groundstation.estimation.models.height import HeightEntries, correct_height
from groundstation.estimation.records import EntityMemory, EntityRow
from groundstation.estimation.register_blocks import copy_to_columns, subtract_square
from groundstation.kernel import kernel


def wide(P):
    """Return P with zeros to a multiple of 8 rows, as the filter keeps it."""
    n = len(P)
    padded = np.zeros((-(-n // 8) * 8,) * 2)
    padded[:n, :n] = P
    return padded


def belief_of(mean, P):
    return Belief(mean, P, EntityRow.rows(1), EntityMemory.rows(1))


def nothing_deferred(n):
    return Deferred(np.zeros((MOST, n)), np.zeros(1, dtype=np.int64))


def put_off(belief, deferred, R, H, y):
    """Defer one dense correction through the compiled kernels; returns the NIS."""
    rows, n = len(H), len(belief.mean)
    W, HPH, factor = np.zeros((4, n)), np.empty((rows, rows)), np.zeros((rows, rows))
    jacobian = Jacobian(np.zeros((4, H.shape[1])), np.arange(H.shape[1]))
    jacobian.F[:rows] = H
    project(belief, deferred, jacobian, H.shape[1], W)
    measured_covariance(W, jacobian, H.shape[1], rows, HPH)
    bound_precision(HPH, R, rows)
    nis = surprise(HPH, R, y, rows, factor)
    apply(belief.mean, belief.P, deferred, rows, W, factor, y)
    return nis


def correct(P, R, H, y):
    """Apply one dense correction of P through the compiled kernels; returns the mean and the NIS."""
    n, padded = len(P), wide(P)
    belief, deferred = belief_of(np.zeros(len(padded)), padded), nothing_deferred(len(padded))
    nis = put_off(belief, deferred, R, H, y)
    make(padded, deferred)
    assert not padded[n:].any() and not padded[:, n:].any()
    P[:] = padded[:n, :n]
    return belief.mean[:n], nis


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
    expected, other, deferred = P.copy(), belief_of(np.zeros(8), wide(P)), nothing_deferred(8)
    H = np.zeros((1, 6))
    H[0, [1, 4, 5]] = 1.0, 1.0, -1.0
    reference, _ = correct(expected, np.array([[0.3]]), H, np.array([0.7]))
    correct_height(other, deferred, HeightEntries(1, 4, 5), 0.7, 0.3, 1e9)
    make(other.P, deferred)
    np.testing.assert_allclose(other.P[:6, :6], expected, atol=1e-9)
    np.testing.assert_allclose(other.mean[:6], reference, atol=1e-9)


def test_a_soft_gate_bounds_the_pull_of_an_outlier() -> None:
    belief, deferred = belief_of(np.zeros(8), wide(np.eye(2))), nothing_deferred(8)
    correct_height(belief, deferred, HeightEntries(0, 1, -1), 1000.0, 0.1, 9.0)
    make(belief.P, deferred)
    assert 0.0 < belief.mean.sum() < 1.0
    np.linalg.cholesky(belief.P[:2, :2])


def test_corrections_that_are_put_off_are_those_made_at_once() -> None:
    rng, n = np.random.default_rng(7), 24
    root = rng.normal(size=(n, n))
    mean, P = rng.normal(size=n), root @ root.T + np.eye(n)
    at_once, later = belief_of(mean.copy(), P.copy()), belief_of(mean.copy(), P.copy())
    deferred, none = nothing_deferred(n), nothing_deferred(n)
    for k in range(30):  # more rows than can be deferred
        H, R, y = rng.normal(size=(1 + k % 4, n)), np.eye(1 + k % 4), rng.normal(size=1 + k % 4)
        nis = put_off(later, deferred, R.copy(), H, y)
        assert nis == pytest.approx(put_off(at_once, none, R.copy(), H, y), rel=1e-9)
        correct_height(later, deferred, HeightEntries(k % 3, 4, 5), 0.1 * k, 0.3, 9.0)
        correct_height(at_once, none, HeightEntries(k % 3, 4, 5), 0.1 * k, 0.3, 9.0)
        make(at_once.P, none)
        assert variance_of(later.P, deferred, 3) == pytest.approx(at_once.P[3, 3], rel=1e-9)
    make(later.P, deferred)
    np.testing.assert_allclose(later.mean, at_once.mean, rtol=0.0, atol=1e-11)
    np.testing.assert_allclose(later.P, at_once.P, rtol=0.0, atol=1e-12)
    assert np.array_equal(later.P, later.P.T)


@pytest.mark.parametrize("rows", [0, 1, 3, 4, 9])
def test_a_square_is_subtracted_from_both_halves(rows: int) -> None:
    rng, n = np.random.default_rng(rows), 40
    root, V = rng.normal(size=(n, n)), rng.normal(size=(12, n))
    P = root @ root.T
    expected = P - V[:rows].T @ V[:rows]
    subtract_square(P, V, rows)
    np.testing.assert_allclose(P, expected, atol=1e-12)
    assert np.array_equal(P, P.T)


@pytest.mark.parametrize("rows", range(1, 17))
@pytest.mark.parametrize(("first", "last"), [(0, 3), (0, 16), (21, 40), (40, 40)])
def test_rows_are_copied_to_their_columns(rows: int, first: int, last: int) -> None:
    P = np.random.default_rng(rows).normal(size=(40, 40))
    row = 4 if first > 20 else 22
    expected = P.copy()
    expected[first:last, row : row + rows] = P[row : row + rows, first:last].T
    copy_to_columns(P, row, rows, first, last)
    np.testing.assert_array_equal(P, expected)


@kernel()
def fly(mean: Vector, P: Matrix, deferred: Deferred, F: Matrix, H: Matrix, R: Matrix, steps: int, worst: Vector) -> int:
    """Predict and correct a small state for many steps; returns the steps after which P was no covariance."""
    n, rows = F.shape[0], H.shape[0]
    W, S, factor, y = np.zeros((4, P.shape[0])), np.zeros((4, 4)), np.zeros((4, 4)), np.zeros(4)
    work = np.zeros((n, n))
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
        apply(mean, P, deferred, rows, W, factor, y)
        make(P, deferred)
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
    bad = fly(np.zeros(8), wide(prior * np.eye(n)), nothing_deferred(8), F, H, noise * np.eye(2), steps, worst)
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
    """P is processed in blocks of 8 by 8; incomplete blocks are corrected as well."""
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
