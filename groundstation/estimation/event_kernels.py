"""The kernel that executes each kind of event."""

import numpy as np

from groundstation.arrays import IntVector
from groundstation.estimation.model_kernels import handle
from groundstation.estimation.observe import change, observe
from groundstation.estimation.records import COMPARED, EVENT_KINDS, OBSERVATION, REPORTED
from groundstation.estimation.reports import report
from groundstation.kernel import address_of


def event_kernels() -> IntVector:
    """Return the addresses of the kernels by kind of event, for `replay`."""
    kernels = np.full(EVENT_KINDS, address_of(change, handle))
    kernels[OBSERVATION] = address_of(observe, handle)
    kernels[REPORTED] = kernels[COMPARED] = address_of(report, handle)
    return kernels
