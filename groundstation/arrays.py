"""The array types of the project; shapes stand in brackets in docstrings."""

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
BoolVector = Annotated[BoolArray, 1]
WordVector = Annotated[NDArray[np.uint64], 1]
