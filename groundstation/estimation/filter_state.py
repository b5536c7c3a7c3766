"""Arguments of the compiled filter: tables, state and inputs, each a value of several arrays.

m modes (joint beliefs kept in parallel), n entries of the state, e entities, s sensors, r steps of the ring.
"""

from typing import NamedTuple

from groundstation.arrays import IntMatrix, IntVector, Matrix, MatrixStack, MatrixStacks, Vector
from groundstation.estimation.records import (
    CondensedOdometry,
    EntityMemory,
    EntityRow,
    EventRow,
    Innovation,
    OutcomeRow,
    PriorRow,
    SensorRow,
)
from groundstation.kernel import Rows, RowsStack, kernel


class Settings(NamedTuple):
    """Settings of the filter (EstimatorParameters); gates (5): of the NIS by rows, the first unused."""

    step_s: float
    wild_gates: float
    divergence_count: int
    divergence_s: float
    gates: Vector


class Tables(NamedTuple):
    """The constant data of the filter.

    entities (m, e): a row per mode, since modes differ in parameters; priors (e); sensors (s); transition (m, m): the
    chances of going from one mode to another within a step; headings: the entries of the state that are headings
    (looking them up in `entities` at each correction would read 31 places with 30 robots).
    """

    entities: RowsStack[EntityRow]
    priors: Rows[PriorRow]
    sensors: Rows[SensorRow]
    settings: Settings
    transition: Matrix
    headings: IntVector

    @property
    def modes(self) -> int:
        """Return the number of joint beliefs that are kept."""
        return len(self.entities)

    @property
    def dim(self) -> int:
        """Return the dimension of the state."""
        return int(self.entities["size"][0].sum())

    def part(self, entity: int) -> slice:
        """Return where an entity's block stands in the state."""
        row = self.entities[0, entity]
        return slice(int(row["start"]), int(row["start"]) + int(row["size"]))


class State(NamedTuple):
    """State of the filter: means (m, n), covariances (m, n, n), the modes' probabilities (m), memory (e).

    used_at (s, e): when a sensor's reading of a subject was last used; deferred (m, r, n) with its rows in use (m, 1):
    corrections still to be made in the covariances (`Deferred`).
    """

    means: Matrix
    covariances: MatrixStack
    weights: Vector
    memory: Rows[EntityMemory]
    used_at: Matrix
    deferred: MatrixStack
    deferred_used: IntMatrix


class Checkpoints(NamedTuple):
    """The state at the beginning of each step, in a ring (r, ...); without deferred corrections.

    Of the covariances only the part that `copy_upper_blocks` copies is valid.
    """

    means: MatrixStack
    covariances: MatrixStacks
    weights: Matrix
    memory: RowsStack[EntityMemory]
    used_at: MatrixStack


class Inputs(NamedTuple):
    """Inputs: odometry by step (r, e), and events in a pool, of which `order` lists rows by time."""

    odometry: RowsStack[CondensedOdometry]
    events: Rows[EventRow]
    order: IntVector
    outcomes: Rows[OutcomeRow]


class Span(NamedTuple):
    """The steps to run, the end of the last one, and the first step whose observations wait."""

    first: int
    last: int
    waiting: int
    now: float


class Moments(NamedTuple):
    """Mean (n) and covariance (n, n)."""

    mean: Vector
    P: Matrix


class Belief(NamedTuple):
    """One mode's belief with its table of entities (e) and their memory (e)."""

    mean: Vector
    P: Matrix
    entities: Rows[EntityRow]
    memory: Rows[EntityMemory]


class Deferred(NamedTuple):
    """Corrections of one mode's covariance, which is P - V^T V for the first `used` (1) rows of V (r, n)."""

    V: Matrix
    used: IntVector


class Hypothesis(NamedTuple):
    """One reading of an observation: z (4), R (4, 4) with the sensor's noise; its innovation (m) and H P by mode."""

    z: Vector
    R: Matrix
    innovations: Rows[Innovation]
    HP: MatrixStack


@kernel(inlined=True)
def belief_of(state: State, tables: Tables, m: int) -> Belief:
    """Return the belief of one mode, by reference."""
    return Belief(state.means[m], state.covariances[m], tables.entities[m], state.memory)


@kernel(inlined=True)
def deferred_of(state: State, m: int) -> Deferred:
    """Return the deferred corrections of one mode's covariance, by reference."""
    return Deferred(state.deferred[m], state.deferred_used[m])
