"""An observer whose readings of landmarks are far beyond the gate: its own belief is wrong, for a landmark has none.

It faces the landmark, and moves towards or away from it as far as the reading asks for: a correction linearised with a
heading that is far off throws it metres away (decision 0371). Where a reading gives no place, noise is added to the
observer's pose until the reading lies on the gate. Nothing is cut: what the others know of it remains, as far as the
noise leaves it.
"""

import numpy as np

from groundstation.arrays import Vector
from groundstation.estimation.correction import surprise
from groundstation.estimation.deferred import variance_of
from groundstation.estimation.filter_state import Belief, Deferred
from groundstation.estimation.linear import wrap
from groundstation.estimation.model_kernels import call_locate
from groundstation.estimation.records import (
    KIND_LANDMARK,
    KIND_ROBOT,
    MAX_ROWS,
    POSE,
    EventRow,
    Innovation,
    SensorRow,
    X,
    Y,
)
from groundstation.kernel import kernel

# Noise of x and y: least, by which factor it is raised, and most [m^2]; that of the heading is as large at this
# distance [m].
_LEAST_M2, _RAISED, _MOST_M2, _LEVER_M = 1e-3, 2.0, 25.0, 2.0
# A heading of a larger variance [rad^2] counts as unknown: no correction that far is linear.
_UNKNOWN_RAD2 = 0.25


@kernel(inlined=True)
def answers_for(belief: Belief, event: EventRow) -> int:
    """Return the entity whose belief a reading confirms or contradicts: its subject, or of a landmark its observer."""
    observer, subject = event.observer, event.subject
    reads_place = belief.entities[subject].kind == KIND_LANDMARK and belief.entities[observer].kind == KIND_ROBOT
    return int(observer if reads_place else subject)


@kernel()
def loosen(belief: Belief, event: EventRow, innovation: Innovation, gate: float) -> None:
    """Add noise to the observer's x, y and heading until the innovation lies on the gate; no correction is deferred.

    innovation: as linearised against this belief; it is not changed.
    """
    rows, H, entity = innovation.prediction.size, innovation.prediction.H_observer, belief.entities[event.observer]
    at, shares = np.array((X, Y, entity.at_yaw)), np.array((1.0, 1.0, 1.0 / _LEVER_M**2))
    known, factor, noise = np.empty((MAX_ROWS, MAX_ROWS)), np.empty((MAX_ROWS, MAX_ROWS)), _LEAST_M2
    while noise < _MOST_M2:
        for i in range(rows):
            for j in range(rows):
                known[i, j] = innovation.HPH[i, j]
                for k in range(POSE - 1):
                    if at[k] >= 0:
                        known[i, j] += noise * shares[k] * H[i, at[k]] * H[j, at[k]]
        if 0.0 <= surprise(known, innovation.R, innovation.y, rows, factor) <= gate:
            break
        noise *= _RAISED
    for k in range(POSE - 1):
        if at[k] >= 0:
            index = entity.start + at[k]
            belief.P[index, index] += noise * shares[k]


@kernel()
def face(
    belief: Belief, deferred: Deferred, sensor: SensorRow, event: EventRow, innovation: Innovation, insists: bool
) -> bool:  # fmt: skip
    """Turn a robot of unknown heading so that its subject lies in the measured bearing; True if the innovation is void.

    Only by a bearing, which does not depend on the heading of the subject. insists: turn it also from a known heading.
    """
    entity, subject, turned = belief.entities[event.observer], belief.entities[event.subject], False
    if entity.kind != KIND_ROBOT or entity.at_yaw < 0:
        return False
    yaw = entity.start + entity.at_yaw
    for i in range(innovation.prediction.size):
        by_subject = innovation.prediction.H_subject[i, subject.at_yaw] if subject.at_yaw >= 0 else 0.0
        # -1 for a bearing: it sinks when the robot turns left.
        by_own = innovation.prediction.H_observer[i, entity.at_yaw]
        if sensor.is_angle[i] == 0 or by_subject != 0.0 or by_own == 0.0:
            continue
        if insists or variance_of(belief.P, deferred, yaw) > _UNKNOWN_RAD2:
            belief.mean[yaw] = wrap(belief.mean[yaw] + innovation.y[i] / by_own)
            turned = True
    return turned


@kernel()
def approach(belief: Belief, sensor: SensorRow, event: EventRow, z: Vector) -> None:
    """Move an observer, without turning it, so that it reads the landmark at its place, if a reading gives a place.

    If it faces the landmark, that is straight towards it or away from it, and no farther than it is off.
    """
    off, start = np.zeros(POSE), belief.entities[event.observer].start
    # A landmark has no block: it is located relative to its own place.
    if call_locate(sensor.locate, (belief, sensor, event, z, off)):
        belief.mean[start + X] -= off[X]
        belief.mean[start + Y] -= off[Y]


@kernel()
def note_move(belief: Belief, e: int, before: Vector) -> None:
    """Add the square of a move and a turn by hand to the variances of x, y and heading; before: the mean before it."""
    entity, mean, P = belief.entities[e], belief.mean, belief.P
    x, y = entity.start + X, entity.start + Y
    moved_m2 = (mean[x] - before[x]) ** 2 + (mean[y] - before[y]) ** 2
    P[x, x] += moved_m2
    P[y, y] += moved_m2
    if entity.at_yaw >= 0:
        yaw = entity.start + entity.at_yaw
        P[yaw, yaw] += wrap(mean[yaw] - before[yaw]) ** 2
