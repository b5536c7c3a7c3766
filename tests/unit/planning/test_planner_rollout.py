"""The planner's kernels against a dense textbook filter and against central differences."""

import math
from dataclasses import dataclass

import numpy as np
import pytest
from scipy.optimize import minimize

from groundstation.arrays import Array
from groundstation.planning.gradient import evaluate
from groundstation.planning.lbfgs import solve
from groundstation.planning.records import CostOptions, CostProblem, EdgeRow
from groundstation.sensing.models import Frustum, OnboardCameraModel, Softness, WorldCameraModel
from groundstation.sensing.visibility import camera_rows, observe

CEILING = WorldCameraModel((0.0, 0.0, 4.2), Frustum.of_picture(1280, 720, 1179, 1179, 5.0))
ONBOARD = OnboardCameraModel((0.09, 0.0, 0.02), Frustum.of_picture(640, 360, 460, 460, 1.9), pan_left_rad=0.1)
CAMERAS = camera_rows([CEILING, ONBOARD], Softness())
OPTIONS = CostOptions(0.3, 0.9, 2e-3, 3e-4, 0.05, 0.1, 1.0, 1.0, np.array([[-0.8, 0.9], [-0.6, 0.7]]), 1e-3, 0.5)
WEIGHTS = np.array([1.0, 2.5])  # of two targets
STEPS = 8


@dataclass
class Case:
    n: int
    cost: CostProblem

    @property
    def scale(self) -> Array:
        return self.cost.scale

    def report(self) -> Array:
        return np.empty(1 + len(self.cost.edges))

    def value(self, u: Array) -> float:
        return float(evaluate(u, self.cost, False, np.empty(u.size), self.report()))

    def gradient(self, u: Array) -> tuple[float, Array]:
        g = np.empty(u.size)
        return float(evaluate(u, self.cost, True, g, self.report())), g


def case(n: int, layout: str, seed: int, targets: int = 1) -> Case:
    rng = np.random.default_rng(seed)
    poses = np.column_stack([rng.uniform(-1, 1, (n, 2)), np.full(n, 1.3), rng.uniform(-3, 3, n)])
    moving = rng.uniform(-0.5, 0.5, (targets, 4))
    heights = np.full((STEPS, n), 1.3)
    d = 3 * n + 4 * targets
    root = rng.normal(size=(d, d)) * 0.05
    prior = root @ root.T + 1e-3 * np.eye(d)
    if layout == "flat":
        edges = [(0, -1, r) for r in range(n)] + [(1, r, n + t) for r in range(n) for t in range(targets)]
    else:
        heights[:] = np.linspace(2.0, 1.2, n)
        edges = [(0, -1, 0), *((1, r, r + 1) for r in range(n - 1)), *((1, n - 1, n + t) for t in range(targets))]
    markers = np.concatenate([np.full(n, 0.08), np.full(targets, 0.4)])
    rows = EdgeRow.rows(len(edges))
    for column, values in zip(("camera", "observer", "subject"), zip(*edges, strict=True), strict=True):
        rows[column] = values
    scale, prior = np.tile([0.42, 0.42, 1.05], n), 0.5 * (prior + prior.T)
    return Case(
        n, CostProblem(scale, poses, moving, heights, prior, rows, CAMERAS, markers, WEIGHTS[:targets].copy(), OPTIONS)
    )


def rotation(yaw: float) -> Array:
    return np.array([[math.cos(yaw), -math.sin(yaw)], [math.sin(yaw), math.cos(yaw)]])


def measurement(case: Case, edge: EdgeRow, places: Array, yaws: Array, height: Array) -> tuple[Array, Array]:
    """H (rows x dim) of one edge in its observer's own yaw frame, and the information of each row."""
    n, d = case.n, case.cost.prior.shape[0]
    camera, a, b = (int(edge[name]) for name in ("camera", "observer", "subject"))
    H = np.zeros((3 if b < n else 2, d))
    to = 3 * b if b < n else 3 * n + 4 * (b - n)
    tall = case.cost.markers[b] + (height[b] if b < n else 0.0)
    eye: WorldCameraModel | OnboardCameraModel = CEILING if camera == 0 else ONBOARD
    if a < 0:
        assert isinstance(eye, WorldCameraModel)
        optical = eye.optical(np.array([*places[b], tall]))
        H[:2, to : to + 2] = np.eye(2)
    else:
        assert isinstance(eye, OnboardCameraModel)
        robot = np.array([*places[a], height[a], yaws[a]])
        optical = eye.optical(robot, np.array([*places[b], tall]))
        R = rotation(yaws[a])
        H[:2, to : to + 2] = R.T
        H[:2, 3 * a : 3 * a + 2] = -R.T
        H[:2, 3 * a + 2] = -np.array([[0, -1], [1, 0]]) @ R.T @ (places[b] - places[a])
    if b < n:
        H[2, to + 2] = 1.0
        if a >= 0:
            H[2, 3 * a + 2] = -1.0
    seen = observe(CAMERAS[camera], *optical)
    return H, np.array([seen.w, seen.w, seen.v][: H.shape[0]])


def textbook(case: Case, u: Array) -> float:
    """Uncertainty by dense matrices: F P F' + Q, then information of the stacked measurements."""
    poses, moving, edges, options = case.cost.poses, case.cost.targets, case.cost.edges, case.cost.options
    dt, discount, P, total = options.step_s, options.discount, case.cost.prior.copy(), 0.0
    q_xy, q_yaw, q_acc = options.robot_position_noise, options.robot_yaw_noise, options.target_acceleration_noise
    n = case.n
    d = P.shape[0]
    places, yaws = np.vstack([poses[:, :2], moving[:, :2]]), poses[:, 3].copy()
    for i in range(STEPS):
        F, Q = np.eye(d), np.zeros((d, d))
        for r in range(n):
            step = dt * rotation(yaws[r] + 0.5 * dt * u[3 * r + 2]) @ u[3 * r : 3 * r + 2]
            F[3 * r : 3 * r + 2, 3 * r + 2] = [-step[1], step[0]]
            Q[range(3 * r, 3 * r + 3), range(3 * r, 3 * r + 3)] = dt * np.array([q_xy, q_xy, q_yaw])
            places[r] += step
            yaws[r] += dt * u[3 * r + 2]
        for t in range(len(moving)):
            places[n + t] += dt * moving[t, 2:]
            for x in (3 * n + 4 * t, 3 * n + 4 * t + 1):
                F[x, x + 2] = dt
                Q[np.ix_([x, x + 2], [x, x + 2])] = q_acc * np.array([[dt**3 / 3, dt**2 / 2], [dt**2 / 2, dt]])
        P = F @ P @ F.T + Q
        information = np.linalg.inv(P)
        for e in range(len(edges)):
            edge = edges[e]
            H, w = measurement(case, edge, places, yaws, case.cost.heights[i])
            information += H.T @ np.diag(w) @ H
        P = np.linalg.inv(information)
        places_of_targets = range(3 * n, d, 4)
        spread = [w * (P[x, x] + P[x + 1, x + 1]) for w, x in zip(WEIGHTS, places_of_targets, strict=False)]
        total += discount ** (i + 1) * sum(spread)
    return total


CASES = [(1, "flat", 1), (2, "flat", 1), (2, "string", 1), (3, "string", 1), (3, "flat", 2)]


@pytest.mark.parametrize(("n", "layout", "targets"), CASES)
def test_the_uncertainty_is_that_of_a_dense_textbook_filter(n: int, layout: str, targets: int) -> None:
    for seed in range(5):
        one = case(n, layout, seed, targets)
        u = np.random.default_rng(100 + seed).uniform(-1, 1, 3 * n) * one.scale
        report = one.report()
        evaluate(u, one.cost, False, np.empty(u.size), report)
        assert report[0] == pytest.approx(textbook(one, u), rel=1e-9)


@pytest.mark.parametrize(("n", "layout", "targets"), CASES)
def test_the_gradient_is_exact(n: int, layout: str, targets: int) -> None:
    for seed in range(8):
        one = case(n, layout, seed, targets)
        u = np.random.default_rng(200 + seed).uniform(-1, 1, 3 * n) * one.scale
        _, g = one.gradient(u)
        differences = np.empty(u.size)
        for j in range(u.size):
            e = np.zeros(u.size)
            e[j] = 3e-6
            # Fourth order, and too short a step to meet one of the penalties' kinks (the cost is once differentiable).
            near, far = one.value(u + e) - one.value(u - e), one.value(u + 2 * e) - one.value(u - 2 * e)
            differences[j] = (8 * near - far) / 36e-6
        assert np.abs(g - differences).max() <= 1e-6 * np.abs(g).max()


@pytest.mark.parametrize(("n", "layout"), [(1, "flat"), (2, "flat"), (2, "string")])
def test_the_search_ends_where_scipy_ends(n: int, layout: str) -> None:
    ratios = []
    for seed in range(10):
        one = case(n, layout, seed)
        x = np.zeros(3 * n)
        cost, evaluations = solve(x, one.cost, 200, 1e-5, one.report())

        def scaled(v: Array, one: Case = one) -> tuple[float, Array]:
            f, g = one.gradient(v * one.scale)
            return f, g * one.scale

        peer = minimize(scaled, np.zeros(3 * n), jac=True, bounds=[(-1, 1)] * (3 * n), method="L-BFGS-B", tol=1e-10)
        assert np.abs(x).max() <= 1.0 and evaluations <= 200
        assert cost == pytest.approx(one.value(x * one.scale), rel=1e-12)
        ratios.append(cost / peer.fun)
    assert np.median(ratios) == pytest.approx(1.0, abs=1e-3)


def test_the_budget_bounds_the_evaluations_and_never_worsens() -> None:
    one = case(2, "flat", 3)
    start = one.value(np.zeros(6))
    for budget in (1, 2, 5, 20):
        x = np.zeros(6)
        cost, evaluations = solve(x, one.cost, budget, 1e-6, one.report())
        assert evaluations <= budget
        assert cost <= start


@pytest.mark.parametrize("broken", [math.nan, math.inf])
def test_a_first_cost_that_is_not_finite_ends_the_search_where_it_began(broken: float) -> None:
    """There is no gradient to follow: any further point would be made of uninitialised memory."""
    one = case(2, "flat", 3)
    one.cost.prior[0, 0] = broken
    x = np.full(6, 0.25)
    cost, evaluations = solve(x, one.cost, 60, 1e-6, one.report())
    assert (cost, evaluations) == (math.inf, 1)
    assert (x == 0.25).all()
