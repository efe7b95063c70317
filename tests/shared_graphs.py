"""The graph of a sensor is made once a process: it takes a second, and hundreds of tests ask for the same ones."""

from dataclasses import replace
from functools import lru_cache, wraps

from ramsight.sensor import kalman as module

_ALIVE = 24  # graphs; the memory of one is about 10 MB


def share_graphs():
    """Let `kalman` make a sensor of what it has made before of an equal unit and equal assumptions.

    Each caller has a sensor of its own, with its own state and parameters; only graph and machine code are shared.
    """
    made = lru_cache(maxsize=_ALIVE)(module.kalman)

    @wraps(module.kalman)
    def kalman(unit, assumptions=None):
        known = made(unit, assumptions or unit.assumptions)
        own = {"parameters": known.parameters.copy(), "initial": known.initial.copy(), "units": dict(known.units)}
        return replace(known, **own)

    module.kalman = kalman
