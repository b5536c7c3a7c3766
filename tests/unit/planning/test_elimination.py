"""Factors, inverses and columns of small matrices against numpy, and their vectors of eight."""

from typing import Any

import numpy as np
import pytest

from groundstation.arrays import Vector
from groundstation.kernel import kernel
from groundstation.planning.dense import cholesky_upper, padded
from groundstation.planning.elimination import eliminate, eliminate_and_invert, negative_inverse, solve_for_columns
from groundstation.planning.lanes import eights, in_lanes, index, repeated

SIZES = [1, 2, 4, 5, 7, 8, 9, 12, 13, 27, 31, 32, 64, 101]


def definite(size: int, seed: int = 0) -> Any:
    """Return a positive definite matrix, padded by ones, arbitrary below its diagonal, and its symmetric form."""
    generator = np.random.default_rng([size, seed])
    matrix, factor = np.eye(padded(size)), generator.normal(size=(size, size))
    matrix[:size, :size] = factor @ factor.T + size * np.eye(size)
    return np.triu(matrix) + np.tril(generator.normal(size=matrix.shape), -1), matrix


@pytest.mark.parametrize("size", SIZES)
def test_factor_and_inverse(size: int) -> None:
    ours, matrix = definite(size)
    factor, panel = ours.copy(), np.empty((8, len(matrix)))
    assert cholesky_upper(factor)
    np.testing.assert_allclose(np.triu(factor), np.linalg.cholesky(matrix).T, rtol=1e-12, atol=1e-12)
    assert negative_inverse(ours, panel)
    np.testing.assert_allclose(-np.triu(ours), np.triu(np.linalg.inv(matrix)), rtol=1e-11, atol=1e-14)


@pytest.mark.parametrize("size", SIZES)
def test_two_matrices_side_by_side(size: int) -> None:
    (one, _), (other, _) = definite(size, 1), definite(size, 2)
    alone, inverse, panel = one.copy(), other.copy(), np.empty((8, len(one)))
    assert eliminate(alone, panel) and negative_inverse(inverse, panel)
    assert eliminate_and_invert(one, other, panel)
    np.testing.assert_array_equal(np.triu(one), np.triu(alone))
    np.testing.assert_array_equal(np.triu(other), np.triu(inverse))


@pytest.mark.parametrize("size", SIZES)
def test_columns_of_inverses(size: int) -> None:
    given = [definite(size, seed) for seed in range(3)]
    factors, panel = np.array([ours for ours, _ in given]), np.empty((8, padded(size)))
    assert all(eliminate(factor, panel) for factor in factors)
    columns = np.full((3, 6, padded(size)), np.nan)
    solve_for_columns(factors, columns, size - 1)
    for i, (_, matrix) in enumerate(given):
        np.testing.assert_allclose(columns[i, 2 - i], np.linalg.inv(matrix)[:, size - 1], rtol=1e-10, atol=1e-14)


def test_indefinite_matrices_are_refused() -> None:
    for bad in (-1.0, 0.0, np.nan):
        for place in range(8):
            matrix, panel = np.eye(8), np.empty((8, 8))
            matrix[place, place] = bad
            assert not cholesky_upper(matrix.copy())
            assert not negative_inverse(matrix.copy(), panel)
            assert not eliminate(matrix.copy(), panel)
            assert not eliminate_and_invert(matrix.copy(), np.eye(8), panel)
            assert not eliminate_and_invert(np.eye(8), matrix.copy(), panel)


@in_lanes
def _elementary(b: Any, x: Any, exponentials: Any, inverse_roots: Any, count: Any) -> None:
    def eight(k: Any, carried: list[Any]) -> list[Any]:
        at = b.mul(k, index(8))
        exponentials.write(x.read(at).exponential(), at)
        inverse_roots.write(exponentials.read(at).inverse_root(), at)
        return carried

    repeated(b, eights(b, index(0), count), [], eight)


@kernel()
def elementary(x: Vector, exponentials: Vector, inverse_roots: Vector) -> None:
    """Write exp(x) and 1 / sqrt(exp(x)) of a multiple of eight numbers."""
    _elementary(x, exponentials, inverse_roots, x.shape[0])


def test_exponential_and_inverse_root() -> None:
    x = np.random.default_rng(0).uniform(-700.0, 700.0, 20_000)
    x[:3] = 0.0, -700.0, 700.0
    exponentials, inverse_roots = np.empty_like(x), np.empty_like(x)
    elementary(x, exponentials, inverse_roots)
    assert np.abs(exponentials / np.exp(x) - 1.0).max() <= 3 * 2.3e-16
    assert np.abs(inverse_roots * np.sqrt(exponentials) - 1.0).max() <= 3 * 2.3e-16
