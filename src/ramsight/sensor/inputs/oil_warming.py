"""How fast the oil warms up, from a thermometer with noise and steps: trapped oil expands by it.

The temperature is smoothed by a first-order filter whose time constant grows with its age up to 20 s. The rate is the
filter's own change over the sample, so that the sum of the rates is the change of the smoothed temperature exactly.
"""

from __future__ import annotations

from dataclasses import dataclass

import casadi as ca

from ramsight.engine.typed_state import leaf
from ramsight.expression import Scalar
from ramsight.sensor.inputs.sample import Sample
from ramsight.sensor.thresholds import SHORTEST_STEP, SMOOTHING_TIME


@dataclass(frozen=True, kw_only=True)
class WarmingState:
    """The smoothed thermometer."""

    temperature: Scalar = leaf("K")  # smoothed [K]
    age: Scalar = leaf("s")  # of the filter [s]


def warming_rate(state: WarmingState, sample: Sample) -> tuple[WarmingState, Scalar]:
    """Rate of the smoothed temperature [K/s]."""
    dt = sample.elapsed
    before = ca.if_else(state.age > 0.0, state.temperature, sample.oil_temperature)
    change = dt / (ca.fmin(state.age, SMOOTHING_TIME) + dt + SHORTEST_STEP) * (sample.oil_temperature - before)
    rate = ca.if_else(dt > 0.0, change / ca.fmax(dt, SHORTEST_STEP), 0.0)
    return WarmingState(temperature=before + change, age=state.age + dt), rate
