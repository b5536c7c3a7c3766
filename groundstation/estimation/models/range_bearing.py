"""Range, bearing, or both, from an entity to another or to a landmark, in the plane.

range = (1 + range_scale) d + range_bias with d = |marker - (x, y)|, or, for a camera that measures distance by the size
of a marker's image, d = its depth, along the optical axis; bearing = atan2(marker - (x, y)) - yaw + bearing_bias. Scale
and biases are states of the observer if it has them.
"""

import math
from dataclasses import dataclass
from typing import ClassVar, Literal

import numpy as np

from groundstation.arrays import Matrix, Vector
from groundstation.estimation.filter_state import Belief
from groundstation.estimation.linear import wrap
from groundstation.estimation.model_kernels import SensorKernels
from groundstation.estimation.models.protocol import SensorDefaults
from groundstation.estimation.models.subject import chain_subject, marker_offset, marker_point
from groundstation.estimation.records import OUT_OF_VIEW, YAW, EventRow, Prediction, SensorRow, X, Y, Z, own_parameters
from groundstation.kernel import Record, kernel


class RangeBearingParameters(Record):
    """Rows of the measurement (-1: not measured), and 1 if the range is a depth."""

    range_row: int
    bearing_row: int
    is_depth: int


_own = own_parameters(RangeBearingParameters)
_NEAREST_M = 0.01  # a bearing to a nearer marker has no information
_LEAST_COS = 0.1  # at larger angles a depth is undefined


@kernel()
def measure_range_bearing(belief: Belief, sensor: SensorRow, event: EventRow, out: Prediction) -> None:
    """Write h(x) and its Jacobians by the observer's and the subject's block."""
    mean, observer, subject = belief.mean, belief.entities[event.observer], belief.entities[event.subject]
    p, h, H_observer, H_subject = _own(sensor), out.h, out.H_observer, out.H_subject
    work = np.zeros((5, 3))
    point, by_point, slopes = work[0], work[1], work[2:]
    marker_point(belief, event, point, slopes)
    start = observer.start
    dx, dy = point[X] - mean[start + X], point[Y] - mean[start + Y]
    distance = max(math.hypot(dx, dy), _NEAREST_M)
    row = p.range_row
    if row >= 0:
        way, scale = distance, 1.0
        by_point[X], by_point[Y] = dx / distance, dy / distance
        if p.is_depth != 0:
            by_point[X], by_point[Y] = math.cos(mean[start + YAW]), math.sin(mean[start + YAW])
            way = by_point[X] * dx + by_point[Y] * dy
        if observer.at_range_scale >= 0:
            scale += mean[start + observer.at_range_scale]
            H_observer[row, observer.at_range_scale] = way
        if p.is_depth != 0:
            H_observer[row, YAW] = scale * (by_point[X] * dy - by_point[Y] * dx)
        h[row] = scale * way
        by_point[X], by_point[Y] = scale * by_point[X], scale * by_point[Y]
        H_observer[row, X], H_observer[row, Y] = -by_point[X], -by_point[Y]
        chain_subject(subject, slopes, by_point, H_subject, row)
        if observer.at_range_bias >= 0:
            h[row] += mean[start + observer.at_range_bias]
            H_observer[row, observer.at_range_bias] = 1.0
    row = p.bearing_row
    if row >= 0:
        h[row] = wrap(math.atan2(dy, dx) - mean[start + YAW])
        by_point[X], by_point[Y] = -dy / distance**2, dx / distance**2
        H_observer[row, X], H_observer[row, Y], H_observer[row, YAW] = -by_point[X], -by_point[Y], -1.0
        chain_subject(subject, slopes, by_point, H_subject, row)
        if observer.at_bearing_bias >= 0:
            h[row] = wrap(h[row] + mean[start + observer.at_bearing_bias])
            H_observer[row, observer.at_bearing_bias] = 1.0


@kernel()
def prepare_range_bearing(belief: Belief, sensor: SensorRow, event: EventRow, z: Vector, R: Matrix) -> int:
    """Refuse an invalid range; R is unchanged."""
    p = _own(sensor)
    if p.range_row >= 0 and z[p.range_row] <= 0.0:
        return -OUT_OF_VIEW
    return 2 if p.range_row >= 0 and p.bearing_row >= 0 else 1


@kernel()
def locate_range_bearing(belief: Belief, sensor: SensorRow, event: EventRow, z: Vector, pose: Vector) -> bool:
    """Write the subject's place [world], and its heading as believed so far: readings do not show it.

    Range or bearing alone cannot place anything.
    """
    p = _own(sensor)
    if p.range_row < 0 or p.bearing_row < 0:
        return False
    mean, start, subject = belief.mean, belief.entities[event.observer].start, belief.entities[event.subject]
    direction = mean[start + YAW] + z[p.bearing_row]
    offset = np.empty(3)
    heading = mean[subject.start + subject.at_yaw] if subject.at_yaw >= 0 else 0.0
    marker_offset(mean, subject, event, heading, offset)
    way = z[p.range_row]
    if p.is_depth != 0:
        way /= max(math.cos(z[p.bearing_row]), _LEAST_COS)
    pose[X] = mean[start + X] + way * math.cos(direction) - offset[X]
    pose[Y] = mean[start + Y] + way * math.sin(direction) - offset[Y]
    pose[Z] = mean[start + Z]
    pose[YAW] = heading
    return True


@dataclass(frozen=True, slots=True)
class RangeBearingSensor(SensorDefaults):
    """A sensor on a robot that measures range, bearing, or both, in the plane.

    is_depth: whether the range comes from the size of an image, which gives the distance along the axis. Real ranges
    repeat their error for the same pair at the same place, for `repeats_s`.
    """

    kernels: ClassVar[SensorKernels] = SensorKernels(measure_range_bearing, prepare_range_bearing, locate_range_bearing)

    carrier: str
    measures: Literal["range", "bearing", "range-bearing"] = "range-bearing"
    is_depth: bool = False
    repeats_s: float = 0.0
    observes_targets: bool = True

    @property
    def angles(self) -> tuple[int, ...]:
        """Return the row of the bearing."""
        return {"range": (), "bearing": (0,), "range-bearing": (1,)}[self.measures]

    def own(self) -> RangeBearingParameters:
        """Return the parameters that the kernels read."""
        return RangeBearingParameters.row(
            range_row=-1 if self.measures == "bearing" else 0,
            bearing_row={"range": -1, "bearing": 0, "range-bearing": 1}[self.measures],
            is_depth=int(self.is_depth),
        )
