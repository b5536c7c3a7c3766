"""The compiled kernels of the planar planner against numpy, complex steps and the reference vectors."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from groundstation.bench.planner_peers import naive, numpy_adjoint
from groundstation.bench.planner_peers.step import edges_of
from groundstation.experiments.planar.edges import exponentials
from groundstation.experiments.planar.objective import cost_and_gradient
from groundstation.experiments.planar.parameters import FIGURE_1, PlanarParameters
from groundstation.experiments.planar.planner import PlanarPlanner, SearchOptions
from groundstation.experiments.planar.problem import load_topology, make_problem, make_workspace
from groundstation.experiments.planar.scenarios import bench_belief
from groundstation.planning.dense import subtract_products


def evaluate(
    mean: Any, covariance: Any, level: Any, parameters: PlanarParameters, x: Any, segments: int = 1
) -> tuple[float, Any]:
    """Return cost and gradient in the order of the robots."""
    problem = make_problem(mean, covariance, parameters, segments)
    work = make_workspace(len(level), parameters.steps)
    load_topology(np.asarray(level, dtype=np.int64), problem, work)
    order = work.order[:-1]
    gradient, out = np.empty(x.size), np.empty((segments, len(level), 2))
    controls = np.ascontiguousarray(x.reshape(segments, -1, 2)[:, order]).ravel()
    value = cost_and_gradient(controls, problem, work, gradient)
    out[:, order] = gradient.reshape(segments, -1, 2)
    return value, out.ravel()


def test_products() -> None:
    generator = np.random.default_rng(1)
    matrix, columns = generator.normal(size=(16, 16)), generator.normal(size=(8, 16))
    matrix += matrix.T
    target = np.zeros((8, 16))
    subtract_products(target, matrix, columns, 5)
    np.testing.assert_allclose(target[:5], -(columns @ matrix)[:5], rtol=1e-12)


def test_exponentials() -> None:
    x = np.random.default_rng(0).uniform(-700.0, 700.0, 20_000)
    x[:3] = 0.0, -700.0, 700.0
    out = np.empty_like(x)
    exponentials(x.copy(), out, len(x))
    assert np.abs(out / np.exp(x) - 1.0).max() <= 2 * 2.3e-16


def test_reference_vectors(real_data: Callable[[str], Path]) -> None:
    for v in json.loads(real_data("planner_vectors.json").read_text()):
        p = v["params"]
        names = ("sigma", "r", "s", "eps", "qr", "qt", "dt", "h", "gamma", "umax")
        values: list[Any] = [*(p[name] for name in names), tuple(p["vt"])]
        parameters = PlanarParameters(*values)
        mean, covariance, level = np.array(v["mu"]), np.array(v["P"]), np.array(v["level"]) - 1
        cost, gradient = evaluate(mean, covariance, level, parameters, np.array(v["u"]) / p["umax"])
        assert cost == pytest.approx(v["cost"], rel=1e-9)
        expected = np.array(v["gradient"])
        assert np.abs(gradient / p["umax"] - expected).max() <= 1e-9 * np.abs(expected).max()
        plan = PlanarPlanner(v["n"], parameters, SearchOptions(wide=False)).plan(mean, covariance, level)
        assert len(plan.certificate) == 1 + len(v["neighbours"])
        assert {c.level for c in plan.certificate[1:]} == {tuple(k - 1 for k in row) for row in v["neighbours"]}
        assert plan.certificate[0].bound == pytest.approx(v["reach_bound"][0], rel=1e-9)
        assert plan.cost == pytest.approx(v["pruned_step"]["cost"], rel=1e-3)
        assert [k + 1 for k in plan.level] == v["pruned_step"]["level"]


@pytest.mark.parametrize(
    "parameters", [PlanarParameters(), FIGURE_1, PlanarParameters(target_velocity_m_s=(0.3, -0.2))]
)
@pytest.mark.parametrize("robots", [1, 2, 5, 9, 20])
def test_cost_and_gradient_against_complex_step(robots: int, parameters: PlanarParameters) -> None:
    for seed in range(3):
        generator = np.random.default_rng([seed, robots])
        mean, covariance, level = bench_belief(robots, "random", seed, parameters)
        x = generator.uniform(-1.0, 1.0, 2 * robots)
        cost, gradient = evaluate(mean, covariance, level, parameters, x)
        oracle = numpy_adjoint.Rollout(mean, covariance, tuple(int(k) for k in level), parameters)
        steps = 1e-30j * np.eye(x.size)
        exact = np.array([oracle.cost(x + step).imag for step in steps]) / 1e-30
        assert cost == pytest.approx(oracle.cost(x), rel=1e-12)
        assert np.abs(gradient - exact).max() <= 1e-12 * np.abs(exact).max()
        full = np.asarray(np.kron(covariance, np.eye(2)), np.float64)
        edges = edges_of(tuple(int(k) for k in level))
        assert cost == pytest.approx(naive.rollout_cost(x, mean, full, edges, parameters), rel=1e-9)


@pytest.mark.parametrize(("segments", "tail"), [(2, 0.0), (5, 0.0), (1, 1e-2), (3, 1e-3)])
def test_gradient_with_segments_and_tail(segments: int, tail: float) -> None:
    parameters = PlanarParameters(tail=tail)
    generator = np.random.default_rng(segments)
    mean, covariance, level = bench_belief(6, "random", 2, parameters)
    x = generator.uniform(-1.0, 1.0, 12 * segments)
    _, gradient = evaluate(mean, covariance, level, parameters, x, segments)
    for k in range(x.size):
        step = np.zeros(x.size)
        step[k] = 1e-5
        ahead = evaluate(mean, covariance, level, parameters, x + step, segments)[0]
        behind = evaluate(mean, covariance, level, parameters, x - step, segments)[0]
        assert gradient[k] == pytest.approx((ahead - behind) / 2e-5, rel=1e-5, abs=1e-8 * np.abs(gradient).max())


def test_equal_segments_cost_what_one_costs() -> None:
    parameters = PlanarParameters()
    mean, covariance, level = bench_belief(5, "two-level", 1, parameters)
    x = np.random.default_rng(3).uniform(-1.0, 1.0, 10)
    one, gradient = evaluate(mean, covariance, level, parameters, x)
    many, parts = evaluate(mean, covariance, level, parameters, np.tile(x, 5), 5)
    assert many == pytest.approx(one, rel=1e-14)
    np.testing.assert_allclose(parts.reshape(5, -1).sum(axis=0), gradient, rtol=1e-11, atol=1e-18)


@pytest.mark.parametrize("process", [1e-3, 1e-12])
def test_extreme_variances_against_covariance_form(process: float) -> None:
    """The short form of the prediction would lose 6 digits with tiny process noise: the planner switches."""
    parameters = PlanarParameters(robot_noise_m2_s=process, target_noise_m2_s=process)
    mean, _, level = bench_belief(6, "two-level", 1, parameters)
    for exponents in ([6] * 7, [-9] * 7, [-9, 6, -3, 0, 3, -6, 6], [6, 6, 6, 0, 0, 0, -9]):
        covariance = np.diag(10.0 ** np.array(exponents, dtype=float))
        x = np.zeros(12)
        value, _ = evaluate(mean, covariance, level, parameters, x)
        assert value == pytest.approx(_joseph_cost(mean, covariance, level, parameters), rel=1e-9)


def _joseph_cost(mean: Any, covariance: Any, level: Any, parameters: PlanarParameters) -> float:
    """Return the cost at zero controls by Joseph updates in extended precision, one edge after another."""
    p = covariance.astype(np.longdouble)
    variance = np.diag(parameters.process_variance(len(mean) - 1)).astype(np.longdouble)
    rollout = numpy_adjoint.Rollout(mean, np.eye(len(mean)), tuple(int(k) for k in level), parameters)
    weights = rollout.weights(mean)[0]
    total = np.longdouble(0.0)
    for i in range(1, parameters.steps + 1):
        p = p + variance
        for row, w in zip(rollout.incidence.astype(np.longdouble), weights, strict=True):
            gain = p @ row / (row @ p @ row + 1 / np.longdouble(w))
            keep = np.eye(len(p), dtype=np.longdouble) - np.outer(gain, row)
            p = keep @ p @ keep.T + np.outer(gain, gain) / np.longdouble(w)
        total += 2 * np.longdouble(parameters.discount) ** i * p[-1, -1]
    return float(total)


@pytest.mark.parametrize("softness_m", [4e-4, 1e-5])
def test_a_reading_may_end_as_sharply_as_a_step(softness_m: float) -> None:
    """Far within the range the exponent left the series' interval of exp, and the target counted as unseen."""
    parameters = PlanarParameters(softness_m=softness_m)
    mean, x = np.array([[0.3, 0.1], [0.45, 0.2], [0.6, 0.3]]), np.zeros(4)
    numpy = numpy_adjoint.Rollout(mean, 0.01 * np.eye(3), (0, 1), parameters).cost(x)
    value, gradient = evaluate(mean, 0.01 * np.eye(3), (0, 1), parameters, x)
    assert value == pytest.approx(numpy, rel=1e-12)
    assert np.isfinite(gradient).all()


def test_distances_must_be_rounded_at_zero() -> None:
    """Above the sensor an unrounded distance has no gradient: NaN ended the descent at its start."""
    with pytest.raises(ValueError, match="epsilon_m must be positive"):
        PlanarParameters(epsilon_m=0.0)
