"""Ranges to anchors fixed in the world: z = |transponder - anchor| + range_bias, with the bias as a state of the pair.

The error of a pair of an anchor and a robot (survey, delays of both antennas, a lasting reflection) stays the same for
seconds: as a state it does not average out.
"""

import math
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from groundstation.arrays import Array, Matrix, Vector
from groundstation.estimation.filter_state import Belief
from groundstation.estimation.layout import EntityKind
from groundstation.estimation.model_kernels import MotionKernels, SensorKernels
from groundstation.estimation.models.protocol import SensorDefaults, Vector3
from groundstation.estimation.models.subject import (
    BY_PITCH,
    BY_ROLL,
    BY_YAW,
    along,
    lean_of,
    offset_in_world,
    write_slopes,
)
from groundstation.estimation.motion import fade, mirror
from groundstation.estimation.records import OUT_OF_VIEW, YAW, EventRow, Prediction, SensorRow, X, Y, Z, own_parameters
from groundstation.kernel import Record, kernel

_NEAREST_M = 0.01


class AnchorParameters(Record):
    """Deviation [m] and correlation time [s] of the bias."""

    bias_std: float
    correlation_s: float


class RangeParameters(Record):
    """Place of the transponder on its robot [m; base], and the reach of its ranges [m]."""

    transponder_x: float
    transponder_y: float
    transponder_z: float
    reach: float


_anchor, _own = own_parameters(AnchorParameters), own_parameters(RangeParameters)


@kernel()
def predict_anchor(belief: Belief, e: int, dt: float) -> None:
    """Let the bias decay to its prior: reflections come and go."""
    entity = belief.entities[e]
    p = _anchor(entity)
    fade(belief.mean, belief.P, entity.start, entity.size, 0, p.bias_std, dt / p.correlation_s)
    mirror(belief.P, entity.start, entity.size, entity.size)


@kernel()
def measure_range(belief: Belief, sensor: SensorRow, event: EventRow, out: Prediction) -> None:
    """Write h(x) and its Jacobians by the anchor's bias and the subject's pose."""
    mean, anchor, subject = belief.mean, belief.entities[event.observer], belief.entities[event.subject]
    p, start, work = _own(sensor), subject.start, np.empty((5, 3))
    offset, away, slopes = work[0], work[1], work[2:]
    yaw, lean = mean[start + YAW], lean_of(mean, subject, event)
    offset_in_world(p.transponder_x, p.transponder_y, p.transponder_z, lean, yaw, offset)
    write_slopes(offset, lean.pitch, yaw, slopes)
    away[X] = mean[start + X] + offset[X] - anchor.place_x
    away[Y] = mean[start + Y] + offset[Y] - anchor.place_y
    away[Z] = mean[start + Z] + offset[Z] - anchor.place_z
    distance = max(math.sqrt(away[X] * away[X] + away[Y] * away[Y] + away[Z] * away[Z]), _NEAREST_M)
    out.h[0] = distance + mean[anchor.start + anchor.at_range_bias]
    out.H_observer[0, anchor.at_range_bias] = 1.0
    for i in (X, Y, Z):
        away[i] /= distance
        out.H_subject[0, i] = away[i]
    out.H_subject[0, YAW] = along(away, slopes, BY_YAW)
    if subject.at_roll_error >= 0:
        out.H_subject[0, subject.at_roll_error] = along(away, slopes, BY_ROLL)
        out.H_subject[0, subject.at_pitch_error] = along(away, slopes, BY_PITCH)


@kernel()
def prepare_range(belief: Belief, sensor: SensorRow, event: EventRow, z: Vector, R: Matrix) -> int:
    """Refuse a range that is invalid or beyond the radio's reach; R is unchanged."""
    if z[0] <= 0.0 or z[0] > _own(sensor).reach:
        return -OUT_OF_VIEW
    return 1


@dataclass(frozen=True, slots=True)
class Anchor:
    """A radio at a surveyed place [m; world] as one robot hears it: its ranges have a lasting bias."""

    kind: ClassVar[EntityKind] = EntityKind.LANDMARK
    labels: ClassVar[tuple[str, ...]] = ("range_bias",)
    kernels: ClassVar[MotionKernels] = MotionKernels(predict_anchor)
    present: ClassVar[bool] = True
    admitted: ClassVar[bool] = True

    place_m: Vector3
    bias_std_m: float = 0.05
    correlation_s: float = 20.0

    def own(self) -> AnchorParameters:
        """Return the parameters that the kernel reads."""
        return AnchorParameters.row(bias_std=self.bias_std_m, correlation_s=self.correlation_s)

    def prior(self) -> Array:
        """Return mean and variance (2, 1) of the bias."""
        return np.array([[0.0], [self.bias_std_m**2]])


@dataclass(frozen=True, slots=True)
class RangeSensor(SensorDefaults):
    """The ranges between one anchor, its carrier, and the transponder of one robot; alone they place no entity."""

    kernels: ClassVar[SensorKernels] = SensorKernels(measure_range, prepare_range)
    observes_targets = False

    carrier: str
    transponder_m: Vector3 = (0.0, 0.0, 0.0)
    reach_m: float = 100.0
    stamp_std_s: float = 0.0

    def own(self) -> RangeParameters:
        """Return the parameters that the kernels read."""
        x, y, z = self.transponder_m
        return RangeParameters.row(transponder_x=x, transponder_y=y, transponder_z=z, reach=self.reach_m)
