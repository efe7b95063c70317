"""The compiled form of an ordinary differential equation: its functions, its elimination and the adaptive loop."""

from __future__ import annotations

import inspect
from dataclasses import dataclass
from functools import lru_cache
from types import ModuleType
from typing import Any

import casadi as ca

from ramsight.engine import kernel, lanes, rodas4
from ramsight.engine.cache import WIDTH, CompiledModule, generated_module, hold, kept_module
from ramsight.engine.elimination import eliminate
from ramsight.engine.equation import OdeModel

FIRST_STEP = 1e-4  # s; of a run
_CORNER_STEP = 1e-3  # s; the first step after a corner of the inputs

_SAMPLE_OUTPUTS = """
def sample_outputs(x, u, slope, parameters, row, out):
    q = np.empty(NQ)
    held = -1
    for i in range(x.shape[0]):
        if row[i] != held:
            held = row[i]
            prepare(parameters[held], q)
        outputs(x[i], u[i], slope[i], q, out[i])
"""


@dataclass(frozen=True)
class Integrated:
    """Where the machine code of `integrate` and `sample_outputs` is."""

    module: str
    constants: dict[str, Any]  # names that its loops know
    functions: tuple[str, ...]


@lru_cache(maxsize=256)
def compile_ode(model: OdeModel) -> CompiledModule:
    """The compiled functions of a model: `integrate`, `sample_outputs` and the parts they are made of."""
    body = _loop(kernel, "DONE, PAUSED") + _SAMPLE_OUTPUTS
    if isinstance(known := vars(model).get("known"), Integrated):
        widths = dict.fromkeys(known.functions, 1)
        return kept_module(known.module, lambda: pieces(model)[0], known.constants, body, widths)
    functions, constants = pieces(model)
    return generated_module(functions, constants, body)


def integrated(model: OdeModel) -> Integrated:
    """Where the machine code of a model is."""
    functions, constants = pieces(model)
    return Integrated(compile_ode(model).name, constants, tuple(functions))


@lru_cache(maxsize=64)
def compile_lanes(model: OdeModel) -> CompiledModule:
    """`integrate_lanes` of a model, for many runs at once."""
    functions, constants = pieces(model)
    needed = {name: function for name, function in functions.items() if name != "outputs"}
    widths = {name: WIDTH for name in needed if name not in {"prepare", "dense"}}
    return generated_module(needed, constants | {"W": WIDTH}, _loop(lanes, "FINISHED, TOO_MANY"), widths)


@lru_cache(maxsize=64)
def compile_outputs(model: OdeModel) -> CompiledModule:
    """`sample_outputs` of a model alone, for who has its states already."""
    functions, constants = pieces(model)
    needed = {name: functions[name] for name in ("prepare", "outputs")}
    return generated_module(needed, constants, _SAMPLE_OUTPUTS)


def _loop(module: ModuleType, first: str) -> str:
    """Source of a loop's module, from its first constant on."""
    source = inspect.getsource(module)
    return source[source.index(first) :]


def pieces(model: OdeModel) -> tuple[dict[str, ca.Function], dict[str, object]]:
    """The functions that a loop calls, and the constants that it knows."""
    x, u, slope = model.x, model.u, model.slope
    jacobian = ca.jacobian(model.rhs, x)
    time_derivative = ca.jtimes(model.rhs, u, slope)
    extra = ca.vertcat(*(output.expression for output in model.outputs)) if model.outputs else ca.SX(0, 1)
    n, nnz = x.numel(), jacobian.nnz()
    everything = ca.vertcat(model.rhs, ca.vec(jacobian.nz[:]), time_derivative, extra)
    reduced, q, prepare = hold(ca.densify(everything), model.p)
    f, jac, ft, out = ca.vertsplit(reduced, [0, n, n + nnz, 2 * n + nnz, reduced.numel()])
    arguments, names, options = [x, u, slope, q], ["x", "u", "slope", "q"], {"cse": True}
    solver = eliminate(jacobian.sparsity())
    functions = {
        "prepare": prepare,
        "rhs_jacobian": ca.Function("rhs_jacobian", arguments, [f, jac, ft], names, ["f", "jac", "ft"], options),
        "outputs": ca.Function("outputs", arguments, [out], names, ["out"], options),
        "factor": solver.factor,
        **rodas4.step_functions(ca.Function("rhs", arguments, [f], names, ["f"], options), solver.solve),
        **rodas4.control_functions(n, model.n_coupled, u.numel()),
    }
    constants: dict[str, object] = {
        "N": n,
        "NC": model.n_coupled,
        "NU": u.numel(),
        "NJ": nnz,
        "NW": solver.n_factors,
        "NQ": q.numel(),
        "FIRST_STEP": FIRST_STEP,
        "CORNER_STEP": _CORNER_STEP,
    }
    return functions, constants
