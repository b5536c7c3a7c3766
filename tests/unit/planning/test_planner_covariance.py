"""The planner's covariance steps on padded matrices against numpy."""

import numpy as np
import pytest

from groundstation.arrays import Array
from groundstation.planning.covariance import between, invert, room_for


def covariance(d: int, seed: int) -> Array:
    root = np.random.default_rng(seed).normal(size=(d, 2 * d))
    return np.asarray(root @ root.T / d)


@pytest.mark.parametrize("d", [1, 3, 5, 8, 12, 23, 32, 34])
def test_an_inverse_is_symmetric_to_the_bit_and_leaves_what_was_added(d: int) -> None:
    P = covariance(d, d)
    wide = room_for(P)
    assert wide.shape[0] % 8 == 0 and wide.shape[0] - d < 8
    invert(wide)
    np.testing.assert_allclose(wide[:d, :d] @ P, np.eye(d), atol=1e-9)
    assert (wide == wide.T).all()
    np.testing.assert_array_equal(wide[d:], np.eye(len(wide))[d:])


@pytest.mark.parametrize("d", [2, 7, 16, 33])
def test_a_product_between_is_that_of_numpy(d: int) -> None:
    A, B = room_for(covariance(d, 1)), room_for(covariance(d, 2))
    B[d:] = 0.0
    C, work = np.full_like(A, np.nan), np.full_like(A, np.nan)
    between(A, B, C, work)
    np.testing.assert_allclose(C, A @ B @ A, rtol=1e-12, atol=1e-12)


def test_inverting_an_indefinite_matrix_gives_nan() -> None:
    wide = room_for(np.diag([1.0, -1.0, 1.0]))
    invert(wide)
    assert np.isnan(np.diag(wide)).all()
