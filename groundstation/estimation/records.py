"""The rows of the compiled filter's tables, and the numbers that stand for kinds and verdicts.

Times are in seconds since the filter's origin. Nothing here belongs to one model: a model's own parameters are a record
in its file, which the kernels find by `own_parameters`.
"""

from collections.abc import Callable
from typing import Annotated, TypeVar

from groundstation.arrays import Array, IntArray
from groundstation.kernel import Record, viewed_as

Own = TypeVar("Own", bound=Record)

MAX_BLOCK = 16
MAX_ROWS = 4  # rows of a measurement
OWN_WORDS = 30  # largest number of a model's own parameters

KIND_ROBOT, KIND_TARGET, KIND_CAMERA, KIND_LANDMARK = range(4)

# Entries of every block that has any: a robot or camera begins with x, y, z, yaw; a target with x, y, vx, vy.
X, Y, Z, YAW = range(4)
VX, VY = 2, 3
POSE = 4  # entries of a pose

# Kinds of events. ADMITTED: the subject may join, and does at once if it has a prior; DISMISSED: it leaves; PLACED: it
# is put at the event's pose; REPORTED: the subject's report of its own motion; COMPARED: the same, not used.
OBSERVATION, ADMITTED, DISMISSED, PLACED, REPORTED, COMPARED = range(6)
EVENT_KINDS = 6

# Verdicts of the compiled filter (names in event_log.py).
(PENDING, ACCEPTED, INFLATED, IMPLAUSIBLE, OUT_OF_VIEW, SINGULAR, OBSERVER_UNKNOWN, SUBJECT_GROUNDED, YAW_MISSING) = (
    range(9)
)
NOT_LOCATED, MISTAKEN, OBSERVER_DOUBTED, OBSERVER_UNCONFIRMED, CONTRADICTED, OBSERVER_HASTY = 9, 10, 11, 12, 13, 14
TURNED = 15

# Entries of a block that other entities' models may need; EntityRow has their indices.
SHARED_LABELS = (
    "z", "yaw", "roll_error", "pitch_error", "velocity_bias_x", "velocity_bias_y", "yaw_offset", "range_bias",
    "range_scale", "bearing_bias",
)  # fmt: skip


class EntityRow(Record):
    """An entity: addresses of its model's kernels (0: none), its block, its place, and its model's own parameters.

    start, size: of the block in the state; kind: KIND_ROBOT and so on; present: 1 if its prior alone puts it into the
    state; at_*: place of an entry in the block (-1: none); place_*: the centre of its marker [m; base] or, without a
    block, where it stands [m; world]; own: see `own_parameters`.
    """

    predict: int
    begin: int
    start: int
    size: int
    kind: int
    present: int
    at_z: int
    at_yaw: int
    at_roll_error: int
    at_pitch_error: int
    at_velocity_bias_x: int
    at_velocity_bias_y: int
    at_yaw_offset: int
    at_range_bias: int
    at_range_scale: int
    at_bearing_bias: int
    place_x: float
    place_y: float
    place_z: float
    own: Annotated[IntArray, (OWN_WORDS,)]


class PriorRow(Record):
    """Mean and variances of an entity that joins, in the order of its block."""

    mean: Annotated[Array, (MAX_BLOCK,)]
    variances: Annotated[Array, (MAX_BLOCK,)]


class SensorRow(Record):
    """A sensor: addresses of its model's kernels, and its model's own parameters.

    is_angle: 1 for each row of a measurement that is an angle; repeats_s: for how long an error of one pair repeats;
    stamp_variance_s2: of the time of measurement; own: see `own_parameters`.
    """

    measure: int
    prepare: int
    locate: int
    is_angle: Annotated[IntArray, (MAX_ROWS,)]
    repeats_s: float
    stamp_variance_s2: float
    own: Annotated[IntArray, (OWN_WORDS,)]


def own_parameters(record: type[Own]) -> Callable[[EntityRow | SensorRow], Own]:
    """Return a function for use inside kernels: the parameters of a row's own model, as the model's record."""
    return viewed_as(record, "own")


class Streak(Record):
    """Contradictions in a row: their number, and the times of the first and the last."""

    count: int
    since: float
    last: float


class EntityMemory(Record):
    """The memory of an entity beside mean and covariance; part of every checkpoint.

    active: 1 if it is in the state; admitted: 1 if it may be; unconfirmed: 1 until a second observation agrees. held_*,
    yaw_rate: inputs held during a step: velocity [m/s; base_stabilized], turn rate [rad/s], roll and pitch [rad];
    slow_v*: the smoothed velocity; commanded_*: the last command of a CommandedRobot; odometry_age_s: since the last
    velocity; attitude_std [rad], yaw_std [rad per root second]: errors as stated by the odometry (0: the model's own
    count); last_yaw, last_reset, has_yaw: the vehicle's own heading [rad; odom] at the step before, received yaw_age_s
    ago; turn_rate [rad/s]: mean until then; turned [rad]: what it is taken to have turned since; keeps_heading: 1 if it
    has neither jumped nor paused since a sighting agreed with the belief's; heading_at: when one last did, or was used
    without its heading. velocity_x, _y, _z: how they change [m/s; world], as last predicted; velocity_doubt [m/s]:
    deviation that surprises of a fixed camera, or of landmarks that it reads, add to the error of the reported
    velocity; noted_error [m/s]: by how much that error was recently seen to exceed that of a sound sensor; unseen_s:
    time predicted since the last sighting. wild: observations far beyond the gate; wild_x, _y: where the last of them
    puts it, relative to its belief [m; world]; astray: landmarks read far beyond the gate; refused: observations by
    which it would have joined if they had not contradicted their observer; corrected_at: last use of an observation;
    seen_variance: of the worse of x and y [m^2] right after it; witnessed_at: when somebody who is seen, or is fixed,
    last saw it. gave_up, gave_up_at, gave_up_whom: number of robots
    recently re-initialised by this one's sightings, the last time, and the last robot.
    """

    active: int
    admitted: int
    unconfirmed: int
    held_vx: float
    held_vy: float
    held_vz: float
    held_roll: float
    held_pitch: float
    yaw_rate: float
    slow_vx: float
    slow_vy: float
    commanded_vx: float
    commanded_rate: float
    odometry_age_s: float
    attitude_std: float
    yaw_std: float
    last_yaw: float
    last_reset: float
    has_yaw: int
    yaw_age_s: float
    turn_rate: float
    turned: float
    keeps_heading: int
    heading_at: float
    velocity_x: float
    velocity_y: float
    velocity_z: float
    velocity_doubt: float
    noted_error: float
    unseen_s: float
    wild: Streak
    wild_x: float
    wild_y: float
    astray: Streak
    refused: Streak
    corrected_at: float
    seen_variance: float
    witnessed_at: float
    witness: int
    gave_up_at: float
    gave_up_whom: int
    gave_up: float


class CondensedOdometry(Record):
    """Odometry of one robot in one step: sums with their counts, and the newest attitude.

    Velocities [m/s; base_stabilized], rate [rad/s], height [m]; newest_at: time of the newest attitude [ns since the
    filter's origin; -1: none], reset: the number of its heading's resets. All are floats: Python adds to them.
    """

    sum_vx: float
    sum_vy: float
    sum_vz: float
    sum_rate: float
    velocity_count: float
    newest_at: float
    newest_yaw: float
    newest_reset: float
    newest_roll: float
    newest_pitch: float
    newest_attitude_std: float
    newest_yaw_std: float
    newest_velocity_std: float
    height_sum: float
    height_count: float


class RawReading(Record):
    """A measurement as received; missing rows are zero, in R those of an identity."""

    z: Annotated[Array, (MAX_ROWS,)]
    R: Annotated[Array, (MAX_ROWS, MAX_ROWS)]


class EventRow(Record):
    """One event at its time of measurement: an observation, or a change of the entities in the state.

    at [s]; kind: OBSERVATION and so on; observer, subject, sensor: numbers in the tables; step: in which `at` lies;
    size: rows of the measurement; has_alternative: 1 if there is a second hypothesis; roll, pitch: the observer's as
    reported [rad]. A PLACED event has its pose and covariance in `measured`. The rest is written when the event is
    reached: roll and pitch of the subject [rad], rates of the first entries of both blocks.
    """

    at: float
    kind: int
    observer: int
    subject: int
    sensor: int
    step: int
    size: int
    has_alternative: int
    roll: float
    pitch: float
    measured: RawReading
    alternative: RawReading
    subject_roll: float
    subject_pitch: float
    observer_rates: Annotated[Array, (POSE,)]
    subject_rates: Annotated[Array, (POSE,)]


class OutcomeRow(Record):
    """The outcome of an event: verdict, and residual with its covariance (row-major) and NIS; size: their rows.

    ahead_x, ahead_y: direction and distance of a sighting from its subject's belief, in deviations [world].
    """

    verdict: int
    size: int
    nis: float
    ahead_x: float
    ahead_y: float
    residual: Annotated[Array, (MAX_ROWS,)]
    covariance: Annotated[Array, (MAX_ROWS * MAX_ROWS,)]
    alternative_chosen: int
    joined: int


class Prediction(Record):
    """A sensor model's prediction: h(x) and its Jacobians by the blocks of observer and subject.

    size: requested rows. All the rest is zero when the model is called: it writes only non-zero entries.
    """

    size: int
    h: Annotated[Array, (MAX_ROWS,)]
    H_observer: Annotated[Array, (MAX_ROWS, MAX_BLOCK)]
    H_subject: Annotated[Array, (MAX_ROWS, MAX_BLOCK)]


class Innovation(Record):
    """An observation against one belief: y = z - h(x), R, H P H^T, the Cholesky factor of S, and the NIS.

    A NIS of -1 says that S is not positive definite: such a belief cannot use the observation.
    """

    prediction: Prediction
    y: Annotated[Array, (MAX_ROWS,)]
    R: Annotated[Array, (MAX_ROWS, MAX_ROWS)]
    HPH: Annotated[Array, (MAX_ROWS, MAX_ROWS)]
    factor: Annotated[Array, (MAX_ROWS, MAX_ROWS)]
    nis: float
