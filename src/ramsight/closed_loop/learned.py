"""What a sensor has learned of its machine, read from its states: the only place that knows their names."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ramsight.sensor.kind import Kind, covariance_of, state_of
from ramsight.sensor.quantity import Quantity
from ramsight.sensor.virtual_sensor import VirtualSensor


def learned_factors(sensor: VirtualSensor) -> tuple[float, float]:
    """Factors of leakage and displacement [1]."""
    state = sensor.state
    leakage, displacement = (state[state_of(Kind.DESCRIBED, one)] for one in (Quantity.LEAKAGE, Quantity.DISPLACEMENT))
    return leakage, displacement


def learned_covariance(sensor: VirtualSensor) -> NDArray[np.float64]:
    """Covariance of position [m], factors of leakage and displacement [1], shape (3, 3)."""
    state, of = sensor.state, (Quantity.POSITION, Quantity.LEAKAGE, Quantity.DISPLACEMENT)
    pairs = [[sorted((i, j), key=of.index) for j in of] for i in of]
    return np.array([[state[covariance_of(Kind.DESCRIBED, *pair)] for pair in row] for row in pairs])
