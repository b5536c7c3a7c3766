"""Range, bearing, or both, from an entity to another or to a landmark, in the plane.

range = (1 + range_scale) d + range_bias with d = |marker - (x, y)|, or, for a camera that tells distance by the size of
a marker's picture, d = its depth, the way along the axis; bearing = atan2(marker - (x, y)) - yaw + bearing_bias. Scale
and biases are states of the observer where it has them.
"""

import math
from dataclasses import dataclass
from typing import ClassVar, Literal

import numpy as np

from groundstation.estimation import slots as s
from groundstation.estimation.belief import Array, IntArray
from groundstation.estimation.dispatch import LOCATE, MEASURE, PREPARE
from groundstation.estimation.kernel import address_of, kernel
from groundstation.estimation.linear import wrap
from groundstation.estimation.models.subject import chain_subject, marker_offset, marker_point

RANGE_ROW, BEARING_ROW, IS_DEPTH = range(s.FIRST_SENSOR_OWN, s.FIRST_SENSOR_OWN + 3)  # rows: -1 if not measured
_NEAREST_M = 0.01  # a bearing to what is nearer says nothing
_LEAST_COS = 0.1  # further aside nothing has a depth


@kernel(MEASURE)
def measure_range_bearing(
    mean: Array, entities: IntArray, parameters: Array, sensor: Array, event: Array, rows: int, h: Array,
    H_observer: Array, H_subject: Array,
) -> None:  # fmt: skip
    """Write h(x) and its Jacobians by the observer's and the subject's block."""
    observer, subject = entities[int(event[s.EVENT_OBSERVER])], entities[int(event[s.EVENT_SUBJECT])]
    work = np.zeros((3, 3))
    point, slope, by_point = work[0], work[1], work[2]
    marker_point(mean, subject, parameters[int(event[s.EVENT_SUBJECT])], event, point, slope)
    start = observer[s.ENTITY_START]
    dx, dy = point[0] - mean[start], point[1] - mean[start + 1]
    distance = max(math.hypot(dx, dy), _NEAREST_M)
    row = int(sensor[RANGE_ROW])
    if row >= 0:
        way, scale = distance, 1.0
        by_point[0], by_point[1] = dx / distance, dy / distance
        if sensor[IS_DEPTH] != 0.0:
            by_point[0], by_point[1] = math.cos(mean[start + s.YAW]), math.sin(mean[start + s.YAW])
            way = by_point[0] * dx + by_point[1] * dy
        if observer[s.AT_RANGE_SCALE] >= 0:
            scale += mean[start + observer[s.AT_RANGE_SCALE]]
            H_observer[row, observer[s.AT_RANGE_SCALE]] = way
        if sensor[IS_DEPTH] != 0.0:
            H_observer[row, s.YAW] = scale * (by_point[0] * dy - by_point[1] * dx)
        h[row] = scale * way
        by_point[0], by_point[1] = scale * by_point[0], scale * by_point[1]
        H_observer[row, s.X], H_observer[row, s.Y] = -by_point[0], -by_point[1]
        chain_subject(subject, slope, by_point, H_subject, row)
        if observer[s.AT_RANGE_BIAS] >= 0:
            h[row] += mean[start + observer[s.AT_RANGE_BIAS]]
            H_observer[row, observer[s.AT_RANGE_BIAS]] = 1.0
    row = int(sensor[BEARING_ROW])
    if row >= 0:
        h[row] = wrap(math.atan2(dy, dx) - mean[start + s.YAW])
        by_point[0], by_point[1] = -dy / distance**2, dx / distance**2
        H_observer[row, s.X], H_observer[row, s.Y], H_observer[row, s.YAW] = -by_point[0], -by_point[1], -1.0
        chain_subject(subject, slope, by_point, H_subject, row)
        if observer[s.AT_BEARING_BIAS] >= 0:
            h[row] = wrap(h[row] + mean[start + observer[s.AT_BEARING_BIAS]])
            H_observer[row, observer[s.AT_BEARING_BIAS]] = 1.0


@kernel(PREPARE)
def prepare_range_bearing(
    entities: IntArray, parameters: Array, sensor: Array, event: Array, z: Array, R: Array
) -> int:
    """Refuse a range that is none; R is as it came."""
    row = int(sensor[RANGE_ROW])
    if row >= 0 and z[row] <= 0.0:
        return -s.OUT_OF_VIEW
    return 2 if row >= 0 and sensor[BEARING_ROW] >= 0.0 else 1


@kernel(LOCATE)
def locate_range_bearing(
    mean: Array, entities: IntArray, parameters: Array, sensor: Array, event: Array, z: Array, pose: Array
) -> int:
    """Write the subject's place [world]; its heading is unknown. Range or bearing alone cannot place anything."""
    if sensor[RANGE_ROW] < 0.0 or sensor[BEARING_ROW] < 0.0:
        return 0
    subject = int(event[s.EVENT_SUBJECT])
    start = entities[int(event[s.EVENT_OBSERVER]), s.ENTITY_START]
    direction = mean[start + s.YAW] + z[int(sensor[BEARING_ROW])]
    offset = np.empty(3)
    marker_offset(entities[subject], parameters[subject], event, 0.0, offset)
    way = z[int(sensor[RANGE_ROW])]
    if sensor[IS_DEPTH] != 0.0:
        way /= max(math.cos(z[int(sensor[BEARING_ROW])]), _LEAST_COS)
    pose[0] = mean[start] + way * math.cos(direction) - offset[0]
    pose[1] = mean[start + 1] + way * math.sin(direction) - offset[1]
    pose[2] = mean[start + s.Z]
    pose[3] = 0.0
    return 1


@dataclass(frozen=True, slots=True)
class RangeBearingSensor:
    """A sensor on a robot that measures range, bearing, or both, in the plane.

    is_depth: the range is told by the size of a picture, which gives the way along the axis. Real ranges repeat their
    error for the same pair at the same place: `repeats_s` is for how long.
    """

    kernels: ClassVar[tuple[int, int, int]] = (
        address_of(measure_range_bearing),
        address_of(prepare_range_bearing),
        address_of(locate_range_bearing),
    )

    carrier: str
    measures: Literal["range", "bearing", "range-bearing"] = "range-bearing"
    is_depth: bool = False
    repeats_s: float = 0.0
    observes_targets: bool = True

    @property
    def angles(self) -> tuple[int, ...]:
        """Return the row of the bearing."""
        return {"range": (), "bearing": (0,), "range-bearing": (1,)}[self.measures]

    def row(self) -> Array:
        """Return the parameters in the columns that the kernels read."""
        row = np.zeros(s.SENSOR_COLUMNS)
        row[RANGE_ROW] = -1.0 if self.measures == "bearing" else 0.0
        row[BEARING_ROW] = {"range": -1.0, "bearing": 0.0, "range-bearing": 1.0}[self.measures]
        row[IS_DEPTH] = float(self.is_depth)
        return row
