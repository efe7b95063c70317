"""What a sensor has learned of its machine, read from its states: the only place that knows their names."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ramsight.sensor.hypothesis import DISPLACEMENT, LEAK
from ramsight.sensor.virtual_sensor import VirtualSensor


def learned_factors(sensor: VirtualSensor) -> tuple[float, float]:
    """Factors of leakage and displacement [1]."""
    state = sensor.state
    return state[f"described_{LEAK}"], state[f"described_{DISPLACEMENT}"]


def learned_covariance(sensor: VirtualSensor) -> NDArray[np.float64]:
    """Covariance of position [m], factors of leakage and displacement [1], shape (3, 3)."""
    state, of = sensor.state, (0, LEAK, DISPLACEMENT)
    return np.array([[state[f"described_covariance_{min(i, j)}{max(i, j)}"] for j in of] for i in of])
