"""A vehicle's own heading (compass, gyroscope): z = yaw + yaw_offset, the offset a state where the vehicle has it."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from groundstation.estimation import slots as s
from groundstation.estimation.belief import Array, IntArray
from groundstation.estimation.dispatch import LOCATE, MEASURE, PREPARE
from groundstation.estimation.kernel import address_of, kernel
from groundstation.estimation.linear import wrap


@kernel(MEASURE)
def measure_heading(
    mean: Array, entities: IntArray, parameters: Array, sensor: Array, event: Array, rows: int, h: Array,
    H_observer: Array, H_subject: Array,
) -> None:  # fmt: skip
    """Write h(x) and its Jacobian; observer and subject are the same entity."""
    entity = entities[int(event[s.EVENT_OBSERVER])]
    start = entity[s.ENTITY_START]
    h[0] = mean[start + s.YAW]
    H_observer[0, s.YAW] = 1.0
    if entity[s.AT_YAW_OFFSET] >= 0:
        h[0] += mean[start + entity[s.AT_YAW_OFFSET]]
        H_observer[0, entity[s.AT_YAW_OFFSET]] = 1.0
    h[0] = wrap(h[0])


@kernel(PREPARE)
def prepare_heading(entities: IntArray, parameters: Array, sensor: Array, event: Array, z: Array, R: Array) -> int:
    """Nothing to add: one row."""
    return 1


@kernel(LOCATE)
def locate_heading(
    mean: Array, entities: IntArray, parameters: Array, sensor: Array, event: Array, z: Array, pose: Array
) -> int:
    """A heading places nothing."""
    return 0


@dataclass(frozen=True, slots=True)
class HeadingSensor:
    """The heading that a vehicle reports itself, as an absolute measurement with its own offset."""

    kernels: ClassVar[tuple[int, int, int]] = (
        address_of(measure_heading),
        address_of(prepare_heading),
        address_of(locate_heading),
    )
    angles: ClassVar[tuple[int, ...]] = (0,)
    observes_targets: ClassVar[bool] = False

    carrier: str
    repeats_s: float = 0.0

    def row(self) -> Array:
        """Return the parameters in the columns that the kernels read: none."""
        return np.zeros(s.SENSOR_COLUMNS)
