"""C from the very graphs that the engine compiles, for the comparison: scalar, or 8 lanes in GCC's vector types."""

from __future__ import annotations

import casadi as ca

from ramsight.engine.cache import instructions

TEXT = {
    ca.OP_ASSIGN: "{0}", ca.OP_ADD: "{0}+{1}", ca.OP_SUB: "{0}-{1}", ca.OP_MUL: "{0}*{1}", ca.OP_DIV: "{0}/{1}",
    ca.OP_NEG: "-{0}", ca.OP_INV: "K(1.0)/{0}", ca.OP_SQ: "{0}*{0}", ca.OP_TWICE: "K(2.0)*{0}", ca.OP_SQRT: "SQRT({0})",
    ca.OP_FABS: "ABS({0})", ca.OP_EXP: "EXP({0})", ca.OP_LOG: "LOG({0})", ca.OP_TANH: "TANH({0})",
    ca.OP_FMIN: "MIN({0},{1})", ca.OP_FMAX: "MAX({0},{1})", ca.OP_LT: "LT({0},{1})", ca.OP_LE: "LE({0},{1})",
    ca.OP_NOT: "NOT({0})", ca.OP_AND: "AND({0},{1})", ca.OP_OR: "OR({0},{1})", ca.OP_IF_ELSE_ZERO: "CHOOSE({0},{1})",
    ca.OP_POW: "POW({0},{1})", ca.OP_CONSTPOW: "POW({0},{1})",
}  # fmt: skip


def c_function(name: str, function: ca.Function) -> str:
    """One SX function as `static void NAME(inputs, outputs)` on arrays of `real`."""
    inputs = [f"const real*restrict {n}" for n in function.name_in()]
    outputs = [f"real*restrict {n.removesuffix('_new')}_" for n in function.name_out()]
    lines, current = [f"static void {name}({', '.join(inputs + outputs)}){{"], {}
    results, label = [], 0
    for code, target, sources, value in instructions(function):
        if code == ca.OP_OUTPUT:
            out = function.name_out(target[0]).removesuffix("_new")
            results.append(f"{out}_[{target[1]}]={current[sources[0]]};")
            continue
        if code == ca.OP_INPUT:
            text = f"{function.name_in(sources[0])}[{sources[1]}]"
        elif code == ca.OP_CONST:
            text = f"K({value!r})"
        else:
            text = TEXT[code].format(*(current[s] for s in sources))
        label += 1
        lines.append(f"const real v{label}={text};")
        current[target[0]] = f"v{label}"
    return "\n".join([*lines, *results, "}"]).replace("K(inf)", "K(INFINITY)")
