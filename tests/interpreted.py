"""The engine's own loop around CasADi's interpreter: slower than machine code, and ready at once.

A graph that one test needs is not worth ten seconds of compiling. Equations, elimination and steps are those of the
compiled run.
"""

from functools import lru_cache

import numpy as np

from ramsight.engine import kernel
from ramsight.engine.ode_module import _SAMPLE_OUTPUTS, _loop, pieces


def _in_place(function):
    """A function on arrays that it writes into; an output `b_new` is written over the input `b`."""
    buffer, run = function.buffer()
    inputs, outputs = function.name_in(), function.name_out()
    own = [np.empty(function.nnz_out(k)) for k in range(len(outputs))]
    for k, array in enumerate(own):
        buffer.set_res(k, memoryview(array))
    over = [inputs.index(name.removesuffix("_new")) if name.endswith("_new") else None for name in outputs]
    places = range(len(inputs))
    fresh = [k for k, place in enumerate(over) if place is None]

    given = [None] * len(inputs)  # kept, so that no other array gets its place in memory

    def call(*arrays):
        for k in places:
            if arrays[k] is not given[k]:
                given[k] = arrays[k]
                buffer.set_arg(k, memoryview(arrays[k]))
        run()
        for place, array in zip(fresh, arrays[len(inputs) :], strict=True):
            array[:] = own[place]
        for k, place in enumerate(over):
            if place is not None:
                arrays[place][...] = own[k]

    return call


class Interpreted:
    """What `ramsight.engine.ode_module.compile_ode` gives, without compiling."""

    def __init__(self, model):
        functions, constants = pieces(model)
        scope = {"np": np, **constants, **{name: _in_place(f) for name, f in functions.items()}}
        exec(_loop(kernel, "DONE, PAUSED") + _SAMPLE_OUTPUTS, scope)
        self.__dict__.update({name: scope[name] for name in ("integrate", "sample_outputs")})
        self.DONE, self.PAUSED = kernel.DONE, kernel.PAUSED
        self.TOO_SMALL, self.NOT_FINITE = kernel.TOO_SMALL, kernel.NOT_FINITE


interpret = lru_cache(maxsize=64)(Interpreted)
