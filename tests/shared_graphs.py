"""Graphs of sensors, and the C of them, are made once a process: that takes seconds, and hundreds of tests ask for them.

Each caller has a sensor of its own, with its own state and parameters; graph, machine code and C are shared.
"""

from dataclasses import replace
from functools import lru_cache, wraps

import numpy as np

from ramsight.deploy import c_sensor
from ramsight.sensor import kalman as pipe

_GRAPHS, _SOURCES = 24, 12  # that are kept; a graph takes about 10 MB
_make, _write = pipe.kalman, c_sensor.sensor_source
_made = lru_cache(maxsize=_GRAPHS)(_make)


@wraps(_make)
def _kalman(unit, assumptions=None):
    known = _made(unit, assumptions or unit.assumptions)
    return replace(
        known, parameters=known.parameters.copy(), initial=known.initial.copy(), units=dict(known.units)
    )


class _Asked:
    """What a sensor's C is made of: its graph, by identity, and its numbers."""

    def __init__(self, sensor):
        self.sensor = sensor
        numbers = np.concatenate([sensor.parameters, sensor.initial]).tobytes()
        self._key = sensor.recursion, sensor.kind, numbers

    def __eq__(self, other):
        return self._key == other._key

    def __hash__(self):
        return hash(self._key)


@lru_cache(maxsize=_SOURCES)
def _written(asked, unit, prefix, machine, **options):
    return _write(asked.sensor, unit, prefix, machine, **options)


@wraps(_write)
def _sensor_source(sensor, unit, prefix, machine, **options):
    found = _written(_Asked(sensor), unit, prefix, machine, **options)
    return replace(found, files=dict(found.files))


def share_graphs():
    """Let all that is imported from now on share them."""
    pipe.kalman, c_sensor.sensor_source = _kalman, _sensor_source


def forget_graphs():
    """Make all of them anew from now on: for tests of what making them twice gives."""
    _made.cache_clear()
    _written.cache_clear()
