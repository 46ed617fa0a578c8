"""Independent reference solutions: nothing here shares an algorithm with the engine."""

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
