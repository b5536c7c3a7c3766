"""The kernels that models provide, declared, and how the filter's loops call them through addresses."""

from collections.abc import Callable
from typing import NamedTuple

from groundstation.arrays import Matrix, Vector
from groundstation.estimation.filter_state import Belief, Deferred, State, Tables
from groundstation.estimation.records import CondensedOdometry, EventRow, OutcomeRow, Prediction, SensorRow
from groundstation.kernel import caller, kernel


def predict(belief: Belief, e: int, dt: float) -> None:
    """Move one entity's block of the mean, and P with it."""


def begin(belief: Belief, deferred: Deferred, odometry: CondensedOdometry, e: int, step_s: float, gate: float) -> None:
    """Take one step's condensed odometry of one entity; gate: of a single row; deferred: what P lacks so far."""


def measure(belief: Belief, sensor: SensorRow, event: EventRow, out: Prediction) -> None:
    """Write h(x) and its Jacobians."""


def prepare(belief: Belief, sensor: SensorRow, event: EventRow, z: Vector, R: Matrix) -> int:
    """Add the sensor's own noise to R; return how many rows of z are used, or minus a verdict.

    P is without the observations of the same instant (deferred.py), except where an entity reports its own motion:
    reports.py makes them first.
    """
    raise NotImplementedError


def locate(belief: Belief, sensor: SensorRow, event: EventRow, z: Vector, pose: Vector) -> bool:
    """Write where z puts its subject (x, y, z, yaw) [world]; False where z alone is not enough."""
    raise NotImplementedError


def handle(state: State, tables: Tables, event: EventRow, out: OutcomeRow) -> None:
    """Let an event happen. No model's kernel, but called so as well: what is linked is compiled again."""


call_predict = caller(predict)
call_begin = caller(begin)
call_measure = caller(measure)
call_prepare = caller(prepare)
call_locate = caller(locate)
call_handle = caller(handle)


@kernel()
def as_measured(belief: Belief, sensor: SensorRow, event: EventRow, z: Vector, R: Matrix) -> int:
    """All rows are used, and R is as it came."""
    return event.size


@kernel()
def places_nothing(belief: Belief, sensor: SensorRow, event: EventRow, z: Vector, pose: Vector) -> bool:
    """A reading alone cannot place its subject."""
    return False


class MotionKernels(NamedTuple):
    """The kernels of a motion model; None where it does nothing."""

    predict: Callable[[Belief, int, float], None] | None = None
    begin: Callable[[Belief, Deferred, CondensedOdometry, int, float, float], None] | None = None


class SensorKernels(NamedTuple):
    """The kernels of an observation model."""

    measure: Callable[[Belief, SensorRow, EventRow, Prediction], None]
    prepare: Callable[[Belief, SensorRow, EventRow, Vector, Matrix], int] = as_measured
    locate: Callable[[Belief, SensorRow, EventRow, Vector, Vector], bool] = places_nothing
