"""Arrays of NumPy by what they hold, for annotations; shapes stand in docstrings."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Bools = NDArray[np.bool_]
Places = NDArray[np.int64]
