"""The array types of the project; docstrings give shapes in brackets."""

import math
from typing import Annotated

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
IntArray = NDArray[np.int64]
BoolArray = NDArray[np.bool_]
# Grey (h, w) or BGR (h, w, 3).
Image = NDArray[np.uint8]

# Contiguous arrays with their number of axes, as compiled functions take them (groundstation.kernel).
Vector = Annotated[Array, 1]
Matrix = Annotated[Array, 2]
MatrixStack = Annotated[Array, 3]
MatrixStacks = Annotated[Array, 4]
IntVector = Annotated[IntArray, 1]
IntMatrix = Annotated[IntArray, 2]
WordVector = Annotated[NDArray[np.uint64], 1]

# Number of float64 in a cache line.
LINE = 8


def zeros_on_a_line(shape: tuple[int, ...]) -> Array:
    """Return zeros that begin on a cache line, so that vectors of 8 numbers never cross into another one."""
    size = math.prod(shape)
    room: Array = np.zeros(size + LINE)
    first = -room.ctypes.data // room.itemsize % LINE
    return room[first : first + size].reshape(shape)
