"""Declarations of the kernels that models provide, and calls to them by address from the filter's loops."""

from collections.abc import Callable
from typing import NamedTuple

from groundstation.arrays import Matrix, Vector
from groundstation.estimation.filter_state import Belief, Deferred, State, Tables
from groundstation.estimation.records import CondensedOdometry, EventRow, OutcomeRow, Prediction, SensorRow
from groundstation.kernel import caller, kernel


def predict(belief: Belief, e: int, dt: float) -> None:
    """Move one entity's block of the mean, and P with it.

    The mean may begin with the block, and P be the block beside an identity (ahead.py): nothing else is read.
    """


def begin(belief: Belief, deferred: Deferred, odometry: CondensedOdometry, e: int, step_s: float, gate: float) -> None:
    """Take one step's condensed odometry of one entity; gate: of a single row.

    deferred: corrections not yet made in P. P is only read or changed in a step with a height (ahead.py).
    """


def measure(belief: Belief, sensor: SensorRow, event: EventRow, out: Prediction) -> None:
    """Write h(x) and its Jacobians."""


def prepare(belief: Belief, sensor: SensorRow, event: EventRow, z: Vector, R: Matrix) -> int:
    """Add the sensor's own noise to R; return how many rows of z are used, or minus a verdict.

    P is without the observations of the same instant (deferred.py), except where an entity reports its own motion:
    reports.py makes them first.
    """
    raise NotImplementedError


def locate(belief: Belief, sensor: SensorRow, event: EventRow, z: Vector, pose: Vector) -> bool:
    """Write the subject's pose (x, y, z, yaw) [world] by z; False if z alone is not enough."""
    raise NotImplementedError


def handle(state: State, tables: Tables, event: EventRow, out: OutcomeRow) -> None:
    """Execute an event. It is no model's kernel, but is called by address too: linked code would be compiled again."""


call_predict = caller(predict)
call_begin = caller(begin)
call_measure = caller(measure)
call_prepare = caller(prepare)
call_locate = caller(locate)
call_handle = caller(handle)


@kernel()
def as_measured(belief: Belief, sensor: SensorRow, event: EventRow, z: Vector, R: Matrix) -> int:
    """Use all rows, and R as received."""
    return event.size


@kernel()
def places_nothing(belief: Belief, sensor: SensorRow, event: EventRow, z: Vector, pose: Vector) -> bool:
    """Return False: a reading alone cannot place its subject."""
    return False


class MotionKernels(NamedTuple):
    """The kernels of a motion model; None for one that does nothing."""

    predict: Callable[[Belief, int, float], None] | None = None
    begin: Callable[[Belief, Deferred, CondensedOdometry, int, float, float], None] | None = None


class SensorKernels(NamedTuple):
    """The kernels of an observation model."""

    measure: Callable[[Belief, SensorRow, EventRow, Prediction], None]
    prepare: Callable[[Belief, SensorRow, EventRow, Vector, Matrix], int] = as_measured
    locate: Callable[[Belief, SensorRow, EventRow, Vector, Vector], bool] = places_nothing
