"""The compiled form of an ordinary differential equation: its functions, its elimination and the adaptive loop."""

from __future__ import annotations

import inspect
from functools import lru_cache
from types import ModuleType

import casadi as ca

from ramsight.engine import elimination, kernel, rodas4
from ramsight.engine.cache import generated_module, hold
from ramsight.equation import OdeModel

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


@lru_cache(maxsize=256)
def compile_ode(model: OdeModel) -> ModuleType:
    """The compiled functions of a model: `integrate`, `sample_outputs` and the parts they are made of."""
    x, u, slope = model.x, model.u, model.slope
    jacobian = ca.jacobian(model.rhs, x)
    time_derivative = ca.jtimes(model.rhs, u, slope)
    extra = ca.vertcat(*(output.expression for output in model.outputs)) if model.outputs else ca.SX(0, 1)
    n, nnz = x.numel(), jacobian.nnz()
    everything = ca.vertcat(model.rhs, ca.vec(jacobian.nz[:]), time_derivative, extra)
    reduced, q, prepare = hold(ca.densify(everything), model.p)
    f, jac, ft, out = ca.vertsplit(reduced, [0, n, n + nnz, 2 * n + nnz, reduced.numel()])
    arguments, names, options = [x, u, slope, q], ["x", "u", "slope", "q"], {"cse": True}
    solver = elimination.eliminate(jacobian.sparsity())
    functions = {
        "prepare": prepare,
        "rhs": ca.Function("rhs", arguments, [f], names, ["f"], options),
        "rhs_jacobian": ca.Function("rhs_jacobian", arguments, [f, jac, ft], names, ["f", "jac", "ft"], options),
        "outputs": ca.Function("outputs", arguments, [out], names, ["out"], options),
        "factor": solver.factor,
        "solve": solver.solve,
    }
    constants = {
        "N": n,
        "NC": model.n_coupled,
        "NU": u.numel(),
        "NJ": nnz,
        "NW": solver.n_factors,
        "NQ": q.numel(),
        "STAGES": rodas4.STAGES,
        "ORDER": rodas4.ORDER,
        "GAMMA": rodas4.GAMMA,
        "CORNER_STEP": _CORNER_STEP,
    }
    loop = inspect.getsource(kernel)
    body = rodas4.stages_source() + loop[loop.index("DONE, PAUSED") :] + _SAMPLE_OUTPUTS
    return generated_module(functions, constants, body)
