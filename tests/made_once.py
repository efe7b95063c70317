"""What takes seconds to make and is asked for by hundreds of tests is made once a process.

These are the graphs of sensors, the C of them, and what is identified by a log. Each is kept by all that it is made of,
and each caller has one that is its own, with its own state and parameters: only what cannot change is shared.
"""

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from functools import lru_cache, wraps
from hashlib import sha256

import numpy as np

from ramsight.calibration import identify as identification
from ramsight.deploy import c_sensor
from ramsight.sensor import kalman as pipe
from ramsight.sensor import machine_model
from ramsight.sensor.assumptions import Assumptions
from ramsight.sensor.circuit import relief
from ramsight.sensor.kind import KINDS

_GRAPHS, _SOURCES, _FOUND = 24, 12, 12  # that are kept; a graph takes about 10 MB
_make, _write, _find = pipe.kalman, c_sensor.sensor_source, identification.identify
_fill = machine_model.delivers
_made = lru_cache(maxsize=_GRAPHS)(_make)


_anew = False


def _once(function: Callable) -> Callable:
    """A function that keeps what it has made, or what it makes it with where all is to be made anew."""
    return function.__wrapped__ if _anew else function


@wraps(_make)
def _kalman(unit, assumptions=None, kinds=KINDS):
    known = _once(_made)(unit, assumptions or unit.assumptions, tuple(kinds))
    return replace(known, parameters=known.parameters.copy(), initial=known.initial.copy(), units=dict(known.units))


class _Of:
    """What something is made of, which may be no key by itself, by what tells it from others."""

    def __init__(self, key, *parts):
        self.key, self.parts = key, parts

    def __eq__(self, other):
        return self.key == other.key

    def __hash__(self):
        return hash(self.key)


@lru_cache(maxsize=256)
def _filled(of, node, way):
    return _fill(*of.parts, node, way)


@wraps(_fill)
def _delivers(balance, node, way):
    """What a pump presses oil into is a matter of the circuit, whatever is assumed of it."""
    circuit = replace(balance.unit, assumptions=Assumptions(), requirement=None)
    return _once(_filled)(_Of(circuit, balance), node, way)


@lru_cache(maxsize=_SOURCES)
def _written(of, unit, prefix, machine, **options):
    return _write(*of.parts, unit, prefix, machine, **options)


@wraps(_write)
def _sensor_source(sensor, unit, prefix, machine, **options):
    numbers = np.concatenate([sensor.parameters, sensor.initial]).tobytes()
    found = _once(_written)(_Of((sensor.recursion, sensor.kind, numbers), sensor), unit, prefix, machine, **options)
    return replace(found, files=dict(found.files))


def _digest(data):
    """Of all columns of a Dataset, of its time, and of what is said of it."""
    text = sha256(repr(data.attrs).encode())
    for name in sorted(map(str, data.variables)):
        values = np.ascontiguousarray(data[name].values)
        content = repr(values.tolist()).encode() if values.dtype.hasobject else values.tobytes()
        text.update(f"{name} {values.dtype} {values.shape} ".encode() + content)
    return text.hexdigest()


@lru_cache(maxsize=_FOUND)
def _found(unit, of):
    steps = []
    return _find(unit, *of.parts, advance=steps.append), steps


@wraps(_find)
def _identify(unit, log, truth, *, advance=None):
    found, steps = _once(_found)(unit, _Of((_digest(log), _digest(truth)), log, truth))
    for step in steps if advance else ():
        advance(step)
    own = {name: dict(value) for name, value in vars(found).items() if isinstance(value, Mapping)}
    return replace(found, **own)


def share():
    """Let all that is imported from now on share them."""
    pipe.kalman, c_sensor.sensor_source, identification.identify = _kalman, _sensor_source, _identify
    machine_model.delivers = relief.delivers = _delivers


@contextmanager
def anew() -> Iterator[None]:
    """Within, all of them are made anew: for tests of what making them twice gives."""
    global _anew
    _anew = True
    try:
        yield
    finally:
        _anew = False
