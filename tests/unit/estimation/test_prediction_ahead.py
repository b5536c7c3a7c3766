"""Several prediction steps accumulated apart from P equal the same steps one by one."""

import numpy as np
import pytest

from groundstation.estimation.ahead import predict_ahead, quiet_from
from groundstation.estimation.filter_state import Inputs, Span, State
from groundstation.estimation.measurement import OdometrySample
from groundstation.estimation.models import (
    CommandedRobot,
    ConstantVelocityTarget,
    CoordinatedTurnTarget,
    FixedMount,
    MotionModel,
    OdometryRobot,
)
from groundstation.estimation.odometry_ring import OdometryRing
from groundstation.estimation.parameters import EstimatorParameters
from groundstation.estimation.records import DISMISSED, OBSERVATION, EventRow, OutcomeRow
from groundstation.estimation.replay import begin_step, predict_modes
from groundstation.estimation.tables import empty_state, tables_from_parameters

NS, STEPS = 10_000_000, 8
MINIMAL = OdometryRobot(slow_states=(), reports_climb=True)
TEAM: dict[str, MotionModel] = {
    "a": OdometryRobot(), "b": MINIMAL, "c": MINIMAL, "d": OdometryRobot(), "e": CommandedRobot(),
    "ceiling": FixedMount((0.0, 0.0, 4.2), 0.0035, 0.01),
    "t": ConstantVelocityTarget(heading=True), "u": CoordinatedTurnTarget(), "v": ConstantVelocityTarget(),
}  # fmt: skip
TABLES = tables_from_parameters(EstimatorParameters(TEAM, {}))


def moving_state(absent: int | None = None) -> State:
    rng, n = np.random.default_rng(3), TABLES.dim
    state = empty_state(TABLES, [True] * len(TEAM))
    root = rng.normal(size=(n, 2 * n))
    state.covariances[0, :n, :n] = 0.01 * (root @ root.T) / n
    state.covariances[0, :] = 0.5 * (state.covariances[0] + state.covariances[0].T)
    state.means[0, :n] = 0.1 * rng.normal(size=n)
    state.memory["active"] = 1
    state.memory["unseen_s"] = 0.6
    if absent is not None:
        part = TABLES.part(absent)
        state.memory["active"][absent] = 0
        state.means[0, part] = 0.0
        state.covariances[0, part] = state.covariances[0, :, part] = 0.0
    return state


def odometry() -> OdometryRing:
    rng, ring = np.random.default_rng(5), OdometryRing(STEPS, len(TEAM))
    for step in range(STEPS - 2):
        for robot in range(5):
            sample = OdometrySample(NS * step, (0.3 * rng.normal(), 0.3 * rng.normal(), 0.1), 0.4, 0.1 * rng.normal())
            ring.add_velocity(step, robot, sample)
            ring.add_attitude(step, robot, sample, NS * step)
    return ring


def inputs_of(ring: OdometryRing, *events: tuple[int, int]) -> Inputs:
    rows = EventRow.rows(len(events))
    for row, (kind, step) in zip(rows, events, strict=True):
        row["kind"], row["step"], row["at"] = kind, step, 0.01 * step + 0.002
    return Inputs(ring.rows, rows, np.arange(len(events)), OutcomeRow.rows(len(events)))


@pytest.mark.parametrize("absent", [None, 1, 5])
def test_steps_ahead_are_steps_one_by_one(absent: int | None) -> None:
    ring, span = odometry(), Span(1, 7, 3, 0.074)
    one_by_one, ahead = moving_state(absent), moving_state(absent)
    for k in range(3, 8):
        begin_step(one_by_one, TABLES, ring.rows[k % STEPS])
        predict_modes(one_by_one, TABLES, min((k + 1) * 0.01, span.now) - k * 0.01)
    predict_ahead(ahead, TABLES, inputs_of(ring), span, 3)
    np.testing.assert_array_equal(ahead.means, one_by_one.means)
    P, wanted = ahead.covariances[0], one_by_one.covariances[0]
    np.testing.assert_array_equal(P, P.T)
    np.testing.assert_allclose(P, wanted, rtol=1e-12, atol=1e-16)
    for e in range(len(TEAM)):
        part = TABLES.part(e)
        np.testing.assert_array_equal(P[part, part], wanted[part, part])
    assert np.asarray(ahead.memory).tobytes() == np.asarray(one_by_one.memory).tobytes()


def test_where_anybody_looks_at_the_covariance_steps_are_run_one_by_one() -> None:
    ring, span = odometry(), Span(1, 7, 3, 0.074)
    assert quiet_from(inputs_of(ring), span, 1) == 3
    assert quiet_from(inputs_of(ring), span, 2) == 8
    assert quiet_from(inputs_of(ring, (OBSERVATION, 5), (DISMISSED, 4)), span, 1) == 5
    assert quiet_from(inputs_of(ring, (DISMISSED, 9)), span, 1) == 3
    ring.add_height(5, 0, 1.2)
    assert quiet_from(inputs_of(ring), span, 1) == 6
