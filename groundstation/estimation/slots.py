"""Columns of the flat arrays that the compiled filter works on; plain ints, so that they compile to constants.

Nothing here belongs to one model: what only one model reads has its columns in that model's file.
"""

# Entity table (int64): addresses of the model's kernels (0: none), place in the state, then where in the block stand
# those entries that other entities' models may ask for (-1: the block has none).
(
    ENTITY_PREDICT,
    ENTITY_BEGIN,
    ENTITY_START,
    ENTITY_SIZE,
    ENTITY_KIND,
    ENTITY_PRESENT,
    AT_Z,
    AT_YAW,
    AT_ROLL_ERROR,
    AT_PITCH_ERROR,
    AT_YAW_OFFSET,
    AT_RANGE_BIAS,
    AT_RANGE_SCALE,
    AT_BEARING_BIAS,
) = range(14)
ENTITY_COLUMNS = 14
SHARED_LABELS = ("z", "yaw", "roll_error", "pitch_error", "yaw_offset", "range_bias", "range_scale", "bearing_bias")
FIRST_SHARED = AT_Z
KIND_ROBOT, KIND_TARGET, KIND_CAMERA, KIND_LANDMARK = range(4)

# Entries of every block that has any: a robot or camera begins with x, y, z, yaw; a target with x, y, vx, vy.
X, Y, Z, YAW = range(4)
VX, VY = 2, 3
MAX_BLOCK = 16

# Parameters of any entity: its marker [base] (or, without a block, its place [world]); then its model's own.
PLACE_X, PLACE_Y, PLACE_Z = range(3)
FIRST_OWN = 3
PARAMETER_COLUMNS = 32

# Sensor table: addresses of the model's kernels apart (int64); here which rows of a measurement are angles, how long an
# error of one pair repeats, the variance of the time of measurement [s^2], then the model's own.
SENSOR_MEASURE, SENSOR_PREPARE, SENSOR_LOCATE = range(3)
SENSOR_KERNELS = 3
SENSOR_ANGLES, SENSOR_REPEAT_S, SENSOR_TIME_VARIANCE, FIRST_SENSOR_OWN = 0, 4, 5, 6
SENSOR_COLUMNS = 20

# Per entity beside mean and covariance, part of every checkpoint.
(
    ACTIVE,
    ADMITTED,
    HELD_VX,
    HELD_VY,
    HELD_VZ,
    ODOMETRY_AGE,
    LAST_YAW,
    LAST_RESET,
    HAS_YAW,
    YAW_RATE,
    STREAK,
    STREAK_START,
    CORRECTED_AT,
    JOINED_AT,
    LAST_VX,
    LAST_RATE,
    SLOW_VX,
    SLOW_VY,
    HELD_ROLL,
    HELD_PITCH,
    RATE_X,
    RATE_Y,
    RATE_Z,
    WILD_AT,
    UNCONFIRMED,
) = range(25)
AUXILIARY_COLUMNS = 25

# Odometry condensed into one step of one robot: sums, counts, and the newest yaw.
(
    SUM_VX,
    SUM_VY,
    SUM_VZ,
    SUM_RATE,
    VELOCITY_COUNT,
    NEWEST_YAW,
    NEWEST_RESET,
    NEWEST_AT,
    HEIGHT_SUM,
    HEIGHT_COUNT,
    NEWEST_ROLL,
    NEWEST_PITCH,
) = range(12)
ODOMETRY_COLUMNS = 12

# One event at its time of measurement: an observation, or a change of who may be in the state.
(
    EVENT_AT,
    EVENT_KIND,
    EVENT_OBSERVER,
    EVENT_SUBJECT,
    EVENT_SENSOR,
    EVENT_ROLL,
    EVENT_PITCH,
    EVENT_HAS_OTHER,
    EVENT_STEP,
) = range(9)
EVENT_Z = 9  # measurement (4) and covariance (16)
EVENT_SIZE = 29  # rows of the measurement: 1 to 4
EVENT_OTHER = 30  # the alternative hypothesis, laid out as at EVENT_Z
# Written when the event is reached: how the subject leans, and how fast the first four entries of both blocks change.
EVENT_SUBJECT_ROLL, EVENT_SUBJECT_PITCH, EVENT_OBSERVER_RATE, EVENT_SUBJECT_RATE = 50, 51, 52, 56
EVENT_COLUMNS = 60
# ADMITTED: may join, and does at once if it has a prior; DISMISSED: leaves; PLACED: is put where the event says.
EVENT_OBSERVATION, EVENT_ADMITTED, EVENT_DISMISSED, EVENT_PLACED = range(4)
EVENT_KINDS = 4

# What became of an event: verdict, NIS, rows, residual (4), its covariance (16), flags.
OUT_VERDICT, OUT_NIS, OUT_SIZE, OUT_RESIDUAL, OUT_COVARIANCE, OUT_OTHER_CHOSEN, OUT_JOINED = 0, 1, 2, 3, 7, 23, 24
OUT_COLUMNS = 25

# Verdicts of the compiled filter (names in event_log.py).
(PENDING, ACCEPTED, INFLATED, IMPLAUSIBLE, OUT_OF_VIEW, SINGULAR, OBSERVER_UNKNOWN, SUBJECT_GROUNDED, YAW_MISSING) = (
    range(9)
)
NOT_LOCATED, MISTAKEN, OBSERVER_DOUBTED, OBSERVER_UNCONFIRMED = 9, 10, 11, 12

# Filter settings handed to the kernels.
SETTING_STEP, SETTING_WILD, SETTING_STREAK, SETTING_STREAK_S, SETTING_GATE = range(5)  # gates by rows follow
