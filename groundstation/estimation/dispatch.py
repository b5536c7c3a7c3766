"""The signatures of all models' kernels, and how the filter's loops call them through addresses.

PREDICT  mean, P, entities, parameters, aux, entity, dt: moves one entity's block of the mean, and P with it
BEGIN    mean, P, entities, parameters, aux, odometry, entity, step, gate: takes one step's condensed odometry
MEASURE  mean, entities, parameters, sensor, event, rows, h, H_observer, H_subject: h(x) and its Jacobians
PREPARE  entities, parameters, sensor, event, z, R: adds the sensor's own noise to R; rows, or minus a verdict
LOCATE   mean, entities, parameters, sensor, event, z, pose: where z puts its subject; 0 when z alone cannot tell

HANDLE, what an event does (events.py), is no model's, but is called so as well: what is linked is compiled again.
"""

from groundstation.estimation.kernel import caller

PREDICT = "void(float64[::1], float64[:,::1], int64[:,::1], float64[:,::1], float64[:,::1], int64, float64)"
BEGIN = (
    "void(float64[::1], float64[:,::1], int64[:,::1], float64[:,::1], float64[:,::1], float64[:,::1], int64,"
    " float64, float64)"
)
MEASURE = (
    "void(float64[::1], int64[:,::1], float64[:,::1], float64[::1], float64[::1], int64, float64[::1],"
    " float64[:,::1], float64[:,::1])"
)
PREPARE = "int64(int64[:,::1], float64[:,::1], float64[::1], float64[::1], float64[::1], float64[:,::1])"
HANDLE = (
    "void(float64[:,::1], float64[:,:,::1], float64[::1], float64[:,::1], int64[:,:,::1], float64[:,:,::1],"
    " float64[:,:,::1], int64[:,::1], float64[:,::1], float64[:,::1], float64[::1], float64[::1], float64[::1])"
)
LOCATE = "int64(float64[::1], int64[:,::1], float64[:,::1], float64[::1], float64[::1], float64[::1], float64[::1])"

call_predict = caller(PREDICT)
call_begin = caller(BEGIN)
call_measure = caller(MEASURE)
call_prepare = caller(PREPARE)
call_locate = caller(LOCATE)
call_handle = caller(HANDLE)
