"""Loops around the filter's own kernels, so that they can be timed without the cost of a call from Python."""

from groundstation.arrays import IntVector
from groundstation.estimation.deferred import make_all
from groundstation.estimation.filter_state import Belief, State, Tables, belief_of
from groundstation.estimation.model_kernels import call_handle
from groundstation.estimation.models.camera import measure_relative_pose
from groundstation.estimation.motion import predict
from groundstation.estimation.records import EventRow, OutcomeRow, Prediction, SensorRow
from groundstation.kernel import Rows, kernel


@kernel()
def predict_often(state: State, tables: Tables, dt: float, times: int) -> None:
    """Predict all entities several times over, by the first mode."""
    belief = belief_of(state, tables, 0)
    for _ in range(times):
        predict(belief, dt)


@kernel()
def correct_frame(
    event_kernels: IntVector, state: State, tables: Tables, events: Rows[EventRow], outcomes: Rows[OutcomeRow]
) -> None:
    """Take all observations of one frame: gate, corrections and outcomes, as in flight."""
    for i in range(events.shape[0]):
        call_handle(event_kernels[events[i].kind], (state, tables, events[i], outcomes[i]))
    make_all(state)


@kernel()
def expect(belief: Belief, sensors: Rows[SensorRow], events: Rows[EventRow], row: int, out: Rows[Prediction]) -> None:
    """Write the predicted observation of one event into the only row of a table, for the peers in Python."""
    expected, event = out[0], events[row]
    expected.size = event.size
    for i in range(expected.h.shape[0]):
        expected.h[i] = 0.0
        for j in range(expected.H_observer.shape[1]):
            expected.H_observer[i, j] = expected.H_subject[i, j] = 0.0
    measure_relative_pose(belief, sensors[event.sensor], event, expected)
