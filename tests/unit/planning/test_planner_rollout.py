"""The planner's kernels against a dense textbook filter and against central differences."""

import math
from dataclasses import dataclass

import numpy as np
import pytest
from scipy.optimize import minimize

from groundstation.arrays import Array
from groundstation.kernel import Rows
from groundstation.planning.bound import lower_bound
from groundstation.planning.gradient import evaluate
from groundstation.planning.local_search import search_state, solve
from groundstation.planning.records import CostOptions, CostProblem, EdgeRow
from groundstation.planning.rollout import soft_box
from groundstation.sensing.models import Box, Frustum, OnboardCameraModel, Softness, WorldCameraModel
from groundstation.sensing.occlusion import BoxRow, box_rows
from groundstation.sensing.visibility import available, camera_rows, limits_of

CEILING = WorldCameraModel((0.0, 0.0, 4.2), Frustum.of_picture(1280, 720, 1179, 1179, 5.0))
ONBOARD = OnboardCameraModel((0.09, 0.0, 0.02), Frustum.of_picture(640, 360, 460, 460, 1.9), pan_left_rad=0.1)
CAMERAS = camera_rows([CEILING, ONBOARD], Softness())
FENCE, STEPS, HEIGHT_M = np.array([[-0.8, 0.9], [-0.6, 0.7]]), 8, 1.5
OPTIONS = CostOptions(STEPS, 0.3, 0.9, 2e-3, 3e-4, 0.05, 0.1, 1.0, 1.0, FENCE, 0.6, 1e-3, 0.5, 3.6, HEIGHT_M)
WEIGHTS = np.array([1.0, 2.5])  # of two targets
BOXES = box_rows([Box((0.2, 0.1), (0.3, 0.4, 1.1)), Box((-0.4, -0.3), (0.2, 0.2, 1.6))])


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
    d = n + 2 * targets
    root = rng.normal(size=(d, d)) * 0.05
    prior = root @ root.T + 1e-3 * np.eye(d)
    if layout == "flat":
        edges = [(0, -1, r, 1) for r in range(n)] + [(1, r, n + t, 1) for r in range(n) for t in range(targets)]
    else:
        poses[:, 2] = np.linspace(2.0, 1.2, n)
        edges = [(0, -1, 0, 1), *((1, r, r + 1, 1) for r in range(n - 1))]
        edges += [(1, n - 1, n + t, 1) for t in range(targets)] + [(0, -1, 1, 0), (1, 0, n, 0)]
    markers = np.concatenate([np.full(n, 0.08), np.full(targets, 0.4)])
    rows = EdgeRow.rows(len(edges))
    for column, values in zip(("camera", "observer", "subject", "wanted"), zip(*edges, strict=True), strict=True):
        rows[column] = values
    rows["blur_m2"], rows["turn_rad2"] = rng.uniform(0.0, 0.05, len(edges)), rng.uniform(0.0, 0.01, len(edges))
    scale, prior, yaws = np.tile([0.42, 0.42, 1.05, 0.6], n), 0.5 * (prior + prior.T), rng.uniform(1e-3, 0.05, n)
    return Case(
        n,
        CostProblem(
            scale,
            poses,
            moving,
            np.full(n, 0.4),
            prior,
            yaws,
            rows,
            CAMERAS,
            markers,
            WEIGHTS[:targets].copy(),
            box_rows([]),
            OPTIONS,
        ),
    )


def seen_by(case: Case, edge: EdgeRow, places: Array, yaws: Array, height: Array) -> tuple[float, float, float, Array]:
    """Return the availability of one edge, its squared length and that of its vertical part, its camera's noise."""
    n = case.n
    camera, a, b = (int(edge[name]) for name in ("camera", "observer", "subject"))
    point = np.array([*places[b], case.cost.markers[b] + (height[b] if b < n else 0.0)])
    eye: WorldCameraModel | OnboardCameraModel = CEILING if camera == 0 else ONBOARD
    if isinstance(eye, WorldCameraModel):
        optical, rise = eye.optical(point), point[2] - eye.position_m[2]
    else:
        optical = eye.optical(np.array([*places[a], height[a], yaws[a]]), point)
        rise = point[2] - height[a] - eye.position_m[2]
    share = Softness().tail_share if edge["wanted"] else 0.0
    x, y, z = optical.tolist()
    seen = available(limits_of(CAMERAS[camera]), x, y, z, float(edge["blur_m2"]), float(edge["turn_rad2"]), share)
    return (
        seen.a,
        float(optical @ optical),
        rise * rise,
        np.array([eye.noise.base_m, eye.noise.per_m, eye.noise.per_m2]),
    )


def textbook(case: Case, u: Array) -> float:
    """Return the uncertainty by dense matrices and Kalman gains: F P F' + Q, then all measurements stacked."""
    cost, options, n = case.cost, case.cost.options, case.n
    poses, moving, edges = cost.poses, cost.targets, cost.edges
    dt, discount, P, total = options.step_s, options.discount, cost.prior.copy(), 0.0
    d, yaw_of = P.shape[0], {0: CEILING.noise.yaw_rad, 1: ONBOARD.noise.yaw_rad}
    places, yaws, s = np.vstack([poses[:, :2], moving[:, :2]]), poses[:, 3].copy(), cost.yaw_variances.copy()
    for i in range(STEPS):
        F, Q = np.eye(d), np.diag([options.robot_position_noise * dt] * n + [0.0] * (d - n))
        for r in range(n):
            yaw, (vx, vy) = yaws[r] + 0.5 * dt * u[4 * r + 2], u[4 * r : 4 * r + 2]
            c, turned = math.cos(yaw), math.sin(yaw)
            places[r] += dt * np.array([c * vx - turned * vy, turned * vx + c * vy])
            yaws[r] += dt * u[4 * r + 2]
        for t in range(len(moving)):
            places[n + t] += dt * moving[t, 2:]
            x = n + 2 * t
            F[x, x + 1] = dt
            q = options.target_acceleration_noise
            Q[x : x + 2, x : x + 2] = q * np.array([[dt**3 / 3, dt**2 / 2], [dt**2 / 2, dt]])
        P, s = F @ P @ F.T + Q, s + options.robot_yaw_noise * dt
        most = cost.climbs * dt * (i + 1)
        height = poses[:, 2] + most * np.tanh((HEIGHT_M + u[3::4] - poses[:, 2]) / most)
        seen = [seen_by(case, edges[e], places, yaws, height) for e in range(len(edges))]
        sharper = 1.0 / s
        for e, (a, _, _, _) in enumerate(seen):
            observer, subject = int(edges[e]["observer"]), int(edges[e]["subject"])
            if subject < n:
                own = yaw_of[int(edges[e]["camera"])] ** 2 / options.readings
                sharper[subject] += a / (own + (s[observer] if observer >= 0 else 0.0))
        s = 1.0 / sharper
        H, R = np.zeros((len(edges), d)), np.zeros(len(edges))
        for e, (a, square, upright, (base, per_m, per_m2)) in enumerate(seen):
            observer, subject = int(edges[e]["observer"]), int(edges[e]["subject"])
            H[e, subject if subject < n else n + 2 * (subject - n)] = 1.0
            turn = s[observer] if observer >= 0 else per_m**2
            if observer >= 0:
                H[e, observer] = -1.0
            single = base**2 + (per_m2 * square) ** 2
            R[e] = (single / options.readings + per_m**2 * upright + turn * (square - upright)) / max(a, 1e-300)
        K = P @ H.T @ np.linalg.inv(H @ P @ H.T + np.diag(R))
        P = P - K @ H @ P
        spread = [2.0 * w * P[x, x] for w, x in zip(WEIGHTS, range(n, d, 2), strict=False)]
        total += discount ** (i + 1) * sum(spread)
    return total


CASES = [(1, "flat", 1), (2, "flat", 1), (2, "string", 1), (3, "string", 1), (3, "flat", 2)]


@pytest.mark.parametrize(("n", "layout", "targets"), CASES)
def test_the_uncertainty_is_that_of_a_dense_textbook_filter(n: int, layout: str, targets: int) -> None:
    for seed in range(5):
        one = case(n, layout, seed, targets)
        u = np.random.default_rng(100 + seed).uniform(-1, 1, 4 * n) * one.scale
        report = one.report()
        evaluate(u, one.cost, False, np.empty(u.size), report)
        # Edges far beyond a range are left out: that costs 1e-6 at most.
        assert report[0] == pytest.approx(textbook(one, u), rel=1e-6)


@pytest.mark.parametrize("boxes", [box_rows([]), BOXES])
@pytest.mark.parametrize(("n", "layout", "targets"), CASES)
def test_the_gradient_is_exact(n: int, layout: str, targets: int, boxes: Rows[BoxRow]) -> None:
    for seed in range(8):
        one = case(n, layout, seed, targets)
        one.cost = one.cost._replace(boxes=boxes)
        u = np.random.default_rng(200 + seed).uniform(-1, 1, 4 * n) * one.scale
        _, g = one.gradient(u)
        differences = np.empty(u.size)
        for j in range(u.size):
            e = np.zeros(u.size)
            e[j] = 3e-6
            # Fourth order, and too short a step to meet a kink of the penalties (the cost is once differentiable).
            near, far = one.value(u + e) - one.value(u - e), one.value(u + 2 * e) - one.value(u - 2 * e)
            differences[j] = (8 * near - far) / 36e-6
        assert np.abs(g - differences).max() <= 1e-6 * np.abs(g).max()


def test_obstacles_increase_the_cost_and_never_reduce_it() -> None:
    hidden = 0
    for seed in range(10):
        one = case(2, "string", seed)
        free = one.value(np.zeros(8))
        one.cost = one.cost._replace(boxes=BOXES)
        assert one.value(np.zeros(8)) >= free * (1.0 - 1e-12)
        hidden += one.value(np.zeros(8)) > 1.01 * free
    assert hidden > 2


def test_a_place_too_near_to_an_obstacle_costs_the_square_of_the_way_out() -> None:
    """Beyond the least distance nothing; over a low box the way out is up."""
    gradient, options = np.zeros(3), OPTIONS
    for place, slope in (((0.85, 0.1, 1.0), (-0.2, 0.0, 0.0)), ((0.2, 0.9, 1.0), (0.0, 0.0, 0.0)),
                         ((0.2, 0.1, 1.6), (0.0, 0.0, -0.2)), ((0.2, -0.6, 1.0), (0.0, 0.2, 0.0))):  # fmt: skip
        at = np.array([place[0], place[1], 0.0, 1.0, 0.0, place[2]])
        gradient[:] = 0.0
        depth = 0.5 * max(map(abs, slope))
        assert soft_box(BOXES[0], at, options, gradient) == pytest.approx(depth**2, abs=1e-12)
        assert gradient == pytest.approx(slope)


def search(one: Case, start: Array, budget: int, tolerance: float) -> tuple[Array, float, int]:
    """Return the best point, its cost and the number of evaluations."""
    state = search_state(start, 1 + len(one.cost.edges))
    solve(state, one.cost, budget, budget, tolerance)
    progress = state.descent.progress[0]
    return state.descent.x, float(progress["cost"]), int(progress["evaluations"])


def test_a_search_in_parts_is_the_search_in_one() -> None:
    one = case(3, "string", 2)
    whole, parts = (search_state(np.zeros(12), 1 + len(one.cost.edges)) for _ in range(2))
    solve(whole, one.cost, 40, 40, 1e-5)
    while not solve(parts, one.cost, 3, 40, 1e-5):
        pass
    assert (parts.descent.x == whole.descent.x).all()
    assert parts.descent.progress[0] == whole.descent.progress[0]


def test_no_controls_get_below_the_bound() -> None:
    rng = np.random.default_rng(5)
    for seed in range(6):
        for n, layout in ((2, "flat"), (3, "string")):
            one = case(n, layout, seed)
            step = OPTIONS.step_s * math.hypot(0.42, 0.42)
            low, high = np.full(n, HEIGHT_M - 0.6), np.maximum(HEIGHT_M + 0.6, one.cost.poses[:, 2])
            bound = lower_bound(one.cost, np.full(n, step), low, high)
            assert bound > 0.0
            for _ in range(20):
                assert one.value(rng.uniform(-1, 1, 4 * n) * one.scale) >= bound


@pytest.mark.parametrize(("n", "layout"), [(1, "flat"), (2, "flat"), (2, "string")])
def test_the_search_ends_where_scipy_ends(n: int, layout: str) -> None:
    ratios = []
    for seed in range(10):
        one = case(n, layout, seed)
        x, cost, evaluations = search(one, np.zeros(4 * n), 200, 1e-5)

        def scaled(v: Array, one: Case = one) -> tuple[float, Array]:
            f, g = one.gradient(v * one.scale)
            return f, g * one.scale

        peer = minimize(scaled, np.zeros(4 * n), jac=True, bounds=[(-1, 1)] * (4 * n), method="L-BFGS-B", tol=1e-10)
        assert np.abs(x).max() <= 1.0 and evaluations <= 200
        assert cost == pytest.approx(one.value(x * one.scale), rel=1e-12)
        ratios.append(cost / peer.fun)
    assert np.median(ratios) == pytest.approx(1.0, abs=1e-3)


def test_the_budget_bounds_the_evaluations_and_never_worsens() -> None:
    one = case(2, "flat", 3)
    start = one.value(np.zeros(8))
    for budget in (1, 2, 5, 20):
        _, cost, evaluations = search(one, np.zeros(8), budget, 1e-6)
        assert evaluations <= budget
        assert cost <= start


def test_a_first_cost_that_is_not_finite_ends_the_search_where_it_began() -> None:
    """There is no gradient to follow: any further point would come from uninitialised memory."""
    one = case(2, "flat", 3)
    one.cost.prior[0, 0] = math.nan
    x, cost, evaluations = search(one, np.full(8, 0.25), 60, 1e-6)
    assert (cost, evaluations) == (math.inf, 1)
    assert (x == 0.25).all()
