"""A vehicle's own heading (compass, gyroscope): z = yaw + yaw_offset, the offset a state if the vehicle has it."""

from dataclasses import dataclass
from typing import ClassVar

from groundstation.arrays import Matrix, Vector
from groundstation.estimation.filter_state import Belief
from groundstation.estimation.linear import wrap
from groundstation.estimation.model_kernels import SensorKernels
from groundstation.estimation.models.protocol import SensorDefaults
from groundstation.estimation.records import YAW, EventRow, Prediction, SensorRow
from groundstation.kernel import kernel


@kernel()
def measure_heading(belief: Belief, sensor: SensorRow, event: EventRow, out: Prediction) -> None:
    """Write h(x) and its Jacobian; observer and subject are the same entity."""
    mean, entity = belief.mean, belief.entities[event.observer]
    out.h[0] = mean[entity.start + YAW]
    out.H_observer[0, YAW] = 1.0
    if entity.at_yaw_offset >= 0:
        out.h[0] += mean[entity.start + entity.at_yaw_offset]
        out.H_observer[0, entity.at_yaw_offset] = 1.0
    out.h[0] = wrap(out.h[0])


@kernel()
def prepare_heading(belief: Belief, sensor: SensorRow, event: EventRow, z: Vector, R: Matrix) -> int:
    """Use one row, with R unchanged."""
    return 1


@dataclass(frozen=True, slots=True)
class HeadingSensor(SensorDefaults):
    """The heading that a vehicle reports itself, as an absolute measurement with its own offset."""

    kernels: ClassVar[SensorKernels] = SensorKernels(measure_heading, prepare_heading)
    angles = (0,)
    observes_targets = False

    carrier: str
    repeats_s: float = 0.0
