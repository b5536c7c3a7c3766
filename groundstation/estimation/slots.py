"""Columns of the flat arrays that the compiled filter works on; plain ints, so that they compile to constants."""

# Blocks of the state. Robots: position, yaw, then slow states; fixed cameras: the first six; targets: VX, VY at 2, 3.
X, Y, Z, YAW, ROLL_ERROR, PITCH_ERROR, CLIMB, SCALE, HEIGHT_ERROR = range(9)
VX, VY = 2, 3
MAX_BLOCK = 9

# Entity table (int64): motion model, first entry of the state, number of entries.
ENTITY_MODEL, ENTITY_START, ENTITY_SIZE = range(3)
ENTITY_COLUMNS = 3

# Motion model numbers; one each per file that implements one (see models.py).
ODOMETRY_ROBOT, CONSTANT_VELOCITY, FIXED_MOUNT = 0, 1, 2

# Parameters of any entity: where its marker is [base], then what its motion model needs.
MARKER_X, MARKER_Y, MARKER_Z = range(3)
(
    VELOCITY_GAIN,
    VELOCITY_DENSITY,
    YAW_DENSITY,
    SCALE_DENSITY,
    CLIMB_STD,
    CLIMB_TAU,
    ATTITUDE_STD,
    ATTITUDE_TAU,
    SCALE_STD,
    HAS_CLIMB_RATE,
    HEIGHT_VARIANCE,
    HEIGHT_STD,
    HEIGHT_TAU,
    HOLD_S,
) = range(3, 17)
ACCELERATION_DENSITY, SPEED_STD = 3, 4
POSITION_DRIFT, ANGLE_DRIFT = 3, 4
PARAMETER_COLUMNS = 17

# Camera table: rotation (9) and translation (3) carrier_from_camera, mounting variances.
CAMERA_ROTATION, CAMERA_TRANSLATION, CAMERA_ATTITUDE_VARIANCE, CAMERA_POSITION_VARIANCE = 0, 9, 12, 13
CAMERA_COLUMNS = 14

# Per entity beside mean and covariance, part of every checkpoint.
(
    ACTIVE,
    AIRBORNE,
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
) = range(14)
AUXILIARY_COLUMNS = 14

# Odometry condensed into one step of one robot: sums, counts, and the newest yaw.
(SUM_VX, SUM_VY, SUM_VZ, VELOCITY_COUNT, NEWEST_YAW, NEWEST_RESET, NEWEST_AT, HEIGHT_SUM, HEIGHT_COUNT) = range(9)
ODOMETRY_COLUMNS = 9

# One event: a camera observation or a change of flight state, at its time of measurement.
(
    EVENT_AT,
    EVENT_KIND,
    EVENT_OBSERVER,
    EVENT_SUBJECT,
    EVENT_CAMERA,
    EVENT_ROLL,
    EVENT_PITCH,
    EVENT_HAS_OTHER,
    EVENT_STEP,
) = range(9)
EVENT_Z = 9  # measurement (4) and covariance (16)
EVENT_SIZE = 29  # rows of the measurement: 3 or 4
EVENT_OTHER = 30  # the alternative hypothesis, laid out as at EVENT_Z
EVENT_COLUMNS = 50
KIND_OBSERVATION, KIND_AIRBORNE, KIND_GROUNDED = 0, 1, 2

# What became of an event: verdict, NIS, rows, residual (4), its covariance (16), flags.
OUT_VERDICT, OUT_NIS, OUT_SIZE, OUT_RESIDUAL, OUT_COVARIANCE, OUT_OTHER_CHOSEN, OUT_JOINED = 0, 1, 2, 3, 7, 23, 24
OUT_COLUMNS = 25

# Verdicts of the compiled filter (names in fixed_lag.py).
(PENDING, ACCEPTED, INFLATED, IMPLAUSIBLE, OUT_OF_VIEW, SINGULAR, OBSERVER_UNKNOWN, SUBJECT_GROUNDED, YAW_MISSING) = (
    range(9)
)

# Filter settings handed to the kernels.
SETTING_STEP, SETTING_WILD, SETTING_STREAK, SETTING_STREAK_S, SETTING_GATE = range(5)  # gates by rows follow
