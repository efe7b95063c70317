"""From a model to machine code: writes a module of its own for each model and lets Numba compile and cache it.

The module's name is the hash of all it depends on (the graph, the method, this engine's sources, the versions of the
compilers), so that a changed model can never meet stale code.
"""

from __future__ import annotations

import importlib.util
import inspect
import json
import os
import sys
import tempfile
from functools import lru_cache
from pathlib import Path
from types import ModuleType
from typing import Any

import casadi as ca
import numpy as np

from ramsight.engine import elimination, kernel, llvm, rodas4
from ramsight.engine.model import OdeModel, content_hash, instructions

_COMPILE = "nb.njit(cache=True, nogil=True, error_model='numpy', fastmath={'contract', 'nsz', 'arcp', 'afn'})"
_CORNER_STEP = 1e-3  # s; the first step after a corner of the inputs
_loaded: dict[str, ModuleType] = {}


def cache_directory() -> Path:
    """Where compiled models are kept: `$RAMSIGHT_CACHE`, else `ramsight` in the user's cache directory."""
    given = os.environ.get("RAMSIGHT_CACHE")
    if given:
        return Path(given)
    base = os.environ.get("XDG_CACHE_HOME")
    return (Path(base) if base else Path.home() / ".cache") / "ramsight"


def programs(model: OdeModel) -> tuple[dict[str, Any], dict[str, int]]:
    """The elementary operations of every function that the kernel needs, and the sizes of its arrays.

    What depends on parameters alone is taken out of the equations and computed once for each segment (`prepare`).
    """
    x, u, slope = model.x, model.u, model.slope
    jacobian = ca.jacobian(model.rhs, x)
    time_derivative = ca.jtimes(model.rhs, u, slope)
    outputs = ca.vertcat(*(output.expression for output in model.outputs)) if model.outputs else ca.SX(0, 1)
    nonzeros = jacobian.nz[:]
    everything = ca.vertcat(model.rhs, ca.vec(nonzeros), time_derivative, ca.densify(outputs))
    reduced, held, values = ca.extract_parametric(ca.cse(everything), model.p)
    q, q_values = ca.vertcat(*held, model.p), ca.vertcat(*values, model.p)
    n, nnz = x.numel(), jacobian.nnz()
    f, jac, ft, out = ca.vertsplit(reduced, [0, n, n + nnz, 2 * n + nnz, reduced.numel()])
    options = {"cse": True}
    functions = {
        "prepare": ca.Function("prepare", [model.p], [ca.densify(q_values)], options),
        "rhs": ca.Function("rhs", [x, u, slope, q], [ca.densify(f)], options),
        "rhs_jacobian": ca.Function("rhs_jacobian", [x, u, slope, q], [ca.densify(f), jac, ca.densify(ft)], options),
        "outputs": ca.Function("outputs", [x, u, slope, q], [out], options),
    }
    solver = elimination.eliminate(jacobian.sparsity())
    functions |= {"factor": solver.factor, "solve": solver.solve}
    sizes = {"N": n, "NC": model.n_coupled, "NU": u.numel(), "NJ": nnz, "NW": solver.n_factors, "NQ": q.numel()}
    return {name: instructions(function) for name, function in functions.items()}, sizes


def _source(sizes: dict[str, int]) -> str:
    """Text of the generated module."""
    constants = sizes | {
        "STAGES": rodas4.STAGES,
        "ORDER": rodas4.ORDER,
        "GAMMA": rodas4.GAMMA,
        "CORNER_STEP": _CORNER_STEP,
    }
    signatures = {
        "prepare": ("p", "q"),
        "rhs": ("x, u, slope, q", "f"),
        "rhs_jacobian": ("x, u, slope, q", "f, jac, ft"),
        "outputs": ("x, u, slope, q", "out"),
        "factor": ("jac, c", "w"),
        "solve": ("w, b", "b"),
    }
    lines = ['"""Generated; may be deleted at any time."""', "import numpy as np", "import numba as nb"]
    lines += ["from ramsight.engine.build import program_loader", "from ramsight.engine.llvm import operations", ""]
    lines += [f"{name} = {value!r}" for name, value in constants.items()]
    lines += [f"compiled = {_COMPILE}", "load = program_loader(__file__)", ""]
    for name, (inputs, outputs) in signatures.items():
        arguments = ", ".join(dict.fromkeys(f"{inputs}, {outputs}".split(", ")))
        lines += [f"_{name} = operations(lambda: load('{name}'))", "@compiled", f"def {name}({arguments}):"]
        lines += [f"    _{name}(({inputs},), ({outputs},))", ""]
    lines += [rodas4.stages_source().replace("def ", "@compiled\ndef ")]
    kernel_source = inspect.getsource(kernel)
    constants_and_loop = kernel_source[kernel_source.index("DONE, PAUSED") :]
    lines += [constants_and_loop.replace("def integrate", "@compiled\ndef integrate")]
    lines += [
        "@compiled",
        "def sample_outputs(x, u, slope, parameters, row, out):",
        "    q = np.empty(NQ)",
        "    held = -1",
        "    for i in range(x.shape[0]):",
        "        if row[i] != held:",
        "            held = row[i]",
        "            prepare(parameters[held], q)",
        "        outputs(x[i], u[i], slope[i], q, out[i])",
        "",
    ]
    return "\n".join(lines)


def program_loader(module_file: str) -> Any:
    """A function that gives a program of the generated module by name; reads the file when first asked."""
    content: dict[str, Any] = {}

    def load(name: str) -> llvm.Program:
        if not content:
            content.update(json.loads(Path(module_file).with_suffix(".json").read_text()))
        program: llvm.Program = content[name]
        return program

    return load


def _write_whole(path: Path, text: str) -> None:
    """Write a file so that another process sees either nothing or all of it."""
    descriptor, temporary = tempfile.mkstemp(dir=path.parent, prefix=path.name)
    with os.fdopen(descriptor, "w") as stream:
        stream.write(text)
    os.replace(temporary, path)


@lru_cache(maxsize=256)
def compile_model(model: OdeModel) -> ModuleType:
    """The compiled functions of a model: `integrate`, `sample_outputs` and the parts they are made of.

    Compiling takes seconds when the model is new and a fraction of a second when it was seen before on this machine.
    """
    content, sizes = programs(model)
    source = _source(sizes)
    engine = [inspect.getsource(module) for module in (llvm,)]
    name = "model_" + content_hash(content, source, engine, ca.__version__, np.__version__, sys.version_info[:2])
    if name in _loaded:
        return _loaded[name]
    folder = cache_directory()
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / f"{name}.py"
    if not path.with_suffix(".json").exists():
        _write_whole(path.with_suffix(".json"), json.dumps(content))
    if not path.exists():
        _write_whole(path, source)
    specification = importlib.util.spec_from_file_location(name, path)
    assert specification is not None
    assert specification.loader is not None
    module = importlib.util.module_from_spec(specification)
    sys.modules[name] = module
    specification.loader.exec_module(module)
    _loaded[name] = module
    return module
