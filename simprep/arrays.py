"""Types of arrays, by what they hold. Shapes and units are in the docstrings."""

import numpy as np
from numpy.typing import NDArray

BoolArray = NDArray[np.bool_]
FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
IndexArray = NDArray[np.intp]
"""What MuJoCo and the functions of numpy that find places give."""
