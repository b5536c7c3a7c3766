"""The effect of one observation on the belief, by the compiled kernels alone."""

import numpy as np
import pytest

from groundstation.bus.messages import Verdict
from groundstation.estimation.event_log import EventLog, change_values, observation_values, write_event
from groundstation.estimation.measurement import Measurement
from groundstation.estimation.models import (
    ConstantVelocityTarget,
    FixedMount,
    ManoeuvringTarget,
    MountedCamera,
    OdometryRobot,
)
from groundstation.estimation.models.protocol import MotionModel
from groundstation.estimation.observe import change, observe
from groundstation.estimation.parameters import WORLD_FROM_DOWN, EstimatorParameters, parameters_from_field
from groundstation.estimation.records import ACCEPTED, DISMISSED, OUT_OF_VIEW, EventRow, OutcomeRow
from groundstation.estimation.tables import empty_state, tables_from_parameters
from groundstation.settings.files import find_field
from groundstation.settings.load import load_field
from groundstation.settings.resolved import resolved_field


def test_a_mode_whose_innovation_has_no_covariance_is_not_corrected_and_loses_its_probability() -> None:
    mount = FixedMount((0.0, 0.0, 4.0), 0.004, 0.02)
    entities: dict[str, MotionModel] = {"ceiling": mount, "rover": ManoeuvringTarget()}
    tables = tables_from_parameters(EstimatorParameters(entities, {"eye": MountedCamera("ceiling", WORLD_FROM_DOWN)}))
    state = empty_state(tables, [True, True])
    state.memory["active"][1] = 1
    rover = tables.part(1)
    for covariance in state.covariances:
        covariance[rover, rover] = np.eye(rover.stop - rover.start)
    state.covariances[1, rover, rover] *= -1.0
    means, covariances = state.means.copy(), state.covariances.copy()
    sight = Measurement(0, "eye", "rover", (0.3, 0.0, 3.6), None, tuple(np.diag([1e-4] * 3).ravel().tolist()))
    events, outcomes = EventRow.rows(1), OutcomeRow.rows(1)
    values = observation_values(sight, 0.0, 0, observer=0, subject=1, sensor=0)
    write_event(np.asarray(events).view(np.uint8).data, 0, values)
    observe(state, tables, events[0], outcomes[0])
    assert outcomes["verdict"][0] == ACCEPTED
    assert abs(state.means[0, rover.start] - 0.3) < 0.01
    np.testing.assert_array_equal(state.means[1], means[1])
    np.testing.assert_array_equal(state.covariances[1], covariances[1])
    assert state.weights.tolist() == [1.0, 0.0]


@pytest.mark.parametrize(("all_round", "verdict"), [(True, ACCEPTED), (False, OUT_OF_VIEW)])
def test_only_a_camera_with_a_lens_has_something_behind_it(all_round: bool, verdict: int) -> None:
    """A body of a motion capture system may lie below its origin, as a marker on the floor does by its noise."""
    system = MountedCamera("mocap", np.eye(3), sees_all_round=all_round)
    entities: dict[str, MotionModel] = {
        "mocap": FixedMount((0.0, 0.0, 0.0), 0.001, 0.002),
        "rover": ConstantVelocityTarget(marker_height_m=0.0),
    }
    tables = tables_from_parameters(EstimatorParameters(entities, {"mocap": system}))
    state = empty_state(tables, [True, True])
    state.memory["active"][0] = state.memory["admitted"][1] = 1
    sight = Measurement(0, "mocap", "rover", (1.0, 0.5, -0.003), None, tuple(np.diag([1e-4] * 3).ravel().tolist()))
    events, outcomes = EventRow.rows(1), OutcomeRow.rows(1)
    values = observation_values(sight, 0.0, 0, observer=0, subject=1, sensor=0)
    write_event(np.asarray(events).view(np.uint8).data, 0, values)
    observe(state, tables, events[0], outcomes[0])
    assert outcomes["verdict"][0] == verdict


def test_a_motion_capture_system_has_no_lens() -> None:
    field = resolved_field(load_field(find_field("mocap-lab")))
    sensors = parameters_from_field(field).sensors
    cameras = {name: one for name, one in sensors.items() if isinstance(one, MountedCamera)}
    assert {name for name, one in cameras.items() if one.sees_all_round} == {*field.sensing_capture} != set()


def test_a_robot_that_lands_takes_no_velocity_errors_into_its_next_flight() -> None:
    tables = tables_from_parameters(EstimatorParameters({"drone": OdometryRobot()}))
    state, learnt = empty_state(tables, [True]), ("noted_error", "slow_vx", "slow_vy")
    state.memory["active"] = 1
    for name in learnt:
        state.memory[name] = 0.7
    events, outcomes = EventRow.rows(1), OutcomeRow.rows(1)
    write_event(np.asarray(events).view(np.uint8).data, 0, change_values(DISMISSED, 0.0, 0, 0))
    change(state, tables, events[0], outcomes[0])
    assert [float(state.memory[name][0]) for name in ("active", *learnt)] == [0.0] * 4


@pytest.mark.parametrize("returned", [-77, -(2**62)])
def test_a_verdict_that_only_its_sensor_model_knows_refuses_the_reading(returned: int) -> None:
    log = EventLog()
    row = log.add(0, "", change_values(DISMISSED, 0.0, 0, 1))
    log.outcomes["verdict"][row] = -returned
    correction = log.correction(row, "drone_1", "anchor", 3.0)
    assert correction.verdict is Verdict.IMPLAUSIBLE
    assert correction.reason == f"refused by its sensor model, whose prepare returned {returned}: no verdict"
