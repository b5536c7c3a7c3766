"""Loops around the filter's own kernels, so that they can be timed without the cost of a call from Python."""

from groundstation.estimation import slots as s
from groundstation.estimation.belief import Array, IntArray
from groundstation.estimation.dispatch import call_handle
from groundstation.estimation.kernel import kernel
from groundstation.estimation.motion import predict


@kernel("void(float64[::1], float64[:,::1], int64[:,::1], float64[:,::1], float64[:,::1], float64, int64)")
def predict_often(
    mean: Array, P: Array, entities: IntArray, parameters: Array, aux: Array, dt: float, times: int
) -> None:
    """Predict all entities several times over."""
    for _ in range(times):
        predict(mean, P, entities, parameters, aux, dt)


@kernel(
    "void(int64[::1], float64[:,::1], float64[:,:,::1], float64[::1], float64[:,::1], int64[:,:,::1], float64[:,:,::1],"
    " float64[:,:,::1], int64[:,::1], float64[:,::1], float64[:,::1], float64[::1], float64[:,::1], float64[:,::1])"
)
def correct_frame(
    event_kernels: IntArray, means: Array, covariances: Array, weights: Array, aux: Array, entities: IntArray,
    parameters: Array, priors: Array, kernels: IntArray, sensors: Array, pairs: Array, settings: Array, events: Array,
    outcomes: Array,
) -> None:  # fmt: skip
    """Take all observations of one frame: gate, correction and outcome, as in flight."""
    for i in range(events.shape[0]):
        arguments = (
            means, covariances, weights, aux, entities, parameters, priors, kernels, sensors, pairs, settings,
            events[i], outcomes[i],
        )  # fmt: skip
        call_handle(event_kernels[int(events[i, s.EVENT_KIND])], arguments)
