"""Builds and calls the C engines."""

from __future__ import annotations

import ctypes
import subprocess
from pathlib import Path

import numpy as np
from c_source import LANES

import ramsight.deploy
from ramsight.deploy.c_function import PLAIN, array_function
from ramsight.engine.ode_module import pieces

HERE = Path(__file__).parent
EXPORTED = Path(ramsight.deploy.__file__).parent / "c"  # the plant's loop, as it is exported


def _pointer(array):
    return array.ctypes.data_as(ctypes.POINTER(ctypes.c_double))


class CEngine:
    """`integrate` for one run, `integrate_lanes` for many, from the model's graphs by gcc -O3 -march=native."""

    def __init__(self, model, folder):
        functions, sizes = pieces(model)
        skip = {"outputs", "dense", "extremes"}
        header = [f"#define {k} {v}" for k, v in sizes.items() if not k.endswith("_STEP")]
        header.append(f"#define NP {model.p.numel()}")
        for lanes, dialect in ((0, PLAIN), (1, LANES)):
            texts = [array_function(name, f, dialect) for name, f in functions.items() if name not in skip]
            Path(folder, "model.h").write_text("\n".join([*header, *texts]))
            command = ["gcc", "-O3", "-march=native", "-ffp-contract=fast", "-fno-math-errno", "-shared", "-fPIC", "-w",
                       f"-DLANES={lanes}", f"-I{folder}", f"-I{EXPORTED}", str(HERE / "rodas.c"), "-o",
                       f"{folder}/rodas{lanes}.so", "-lmvec", "-lm"]  # fmt: skip
            subprocess.run(command, check=True)
        self._one = ctypes.CDLL(f"{folder}/rodas0.so").integrate
        self._many = ctypes.CDLL(f"{folder}/rodas1.so").integrate_lanes
        for function in (self._one, self._many):
            function.restype = ctypes.c_long

    def one(self, initial, segments, rtol, atol):
        """Final state of one run."""
        y = np.array(initial)
        corners = np.column_stack([segments.start, segments.end])
        steps = self._one(
            ctypes.c_long(len(corners)), _pointer(corners), _pointer(segments.value), _pointer(segments.slope),
            _pointer(segments.parameters), ctypes.c_double(rtol), _pointer(atol), _pointer(y),
        )  # fmt: skip
        assert steps > 0
        return y

    def many(self, states, corners, values, slopes, parameters, rtol, atol):
        """Final states of runs that share their corners; releases the interpreter while it works."""
        y = states.copy()
        self._many(
            ctypes.c_long(len(y)), ctypes.c_long(len(corners)), _pointer(corners), _pointer(values), _pointer(slopes),
            _pointer(parameters), ctypes.c_double(rtol), _pointer(atol), _pointer(y),
        )  # fmt: skip
        return y
