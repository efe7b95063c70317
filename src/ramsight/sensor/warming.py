"""How fast the oil warms up, from a thermometer with noise and steps: what is shut in expands by it."""

from __future__ import annotations

from typing import Any

import casadi as ca

from ramsight.sensor.virtual_sensor import SensorGraph

_SLOW = 20.0  # s; a thermometer's noise of 0.2 K is gone after it, and oil warms by less than a kelvin meanwhile
_INSTANT = 1e-3  # s; so that a first sample is taken as it is


def warming_of(graph: SensorGraph) -> Any:
    """Rate of a smoothed temperature [K/s]: its sum over the samples is the change of that temperature, to the digit.

    Args:
        graph: gains states.
    """
    smooth, age = graph.state("smooth_temperature"), graph.state("smooth_age")
    dt = graph.elapsed
    before = ca.if_else(age > 0.0, smooth, graph.oil_temperature)
    change = dt / (ca.fmin(age, _SLOW) + dt + _INSTANT) * (graph.oil_temperature - before)
    graph.becomes("smooth_temperature", before + change)
    graph.becomes("smooth_age", age + dt)
    return ca.if_else(dt > 0.0, change / ca.fmax(dt, _INSTANT), 0.0)
