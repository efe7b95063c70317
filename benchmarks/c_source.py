"""The exporter's C in GCC's vector types, 8 runs side by side: conditions are reals that are 0 or 1."""

from __future__ import annotations

import casadi as ca

from ramsight.deploy.c_function import Dialect, Term, literal
from ramsight.engine.graph import SELECT

TEXT = {
    ca.OP_ASSIGN: "{0}", ca.OP_ADD: "{0}+{1}", ca.OP_SUB: "{0}-{1}", ca.OP_MUL: "{0}*{1}", ca.OP_DIV: "{0}/{1}",
    ca.OP_NEG: "-{0}", ca.OP_INV: "K(1.0)/{0}", ca.OP_SQ: "{0}*{0}", ca.OP_TWICE: "K(2.0)*{0}", ca.OP_SQRT: "SQRT({0})",
    ca.OP_FABS: "ABS({0})", ca.OP_EXP: "EXP({0})", ca.OP_LOG: "LOG({0})", ca.OP_TANH: "TANH({0})",
    ca.OP_FMIN: "MIN({0},{1})", ca.OP_FMAX: "MAX({0},{1})", ca.OP_LT: "LT({0},{1})", ca.OP_LE: "LE({0},{1})",
    ca.OP_NOT: "NOT({0})", ca.OP_AND: "AND({0},{1})", ca.OP_OR: "OR({0},{1})", ca.OP_IF_ELSE_ZERO: "CHOOSE({0},{1})",
    ca.OP_POW: "POW({0},{1})", ca.OP_CONSTPOW: "POW({0},{1})", SELECT: "pick({0}!=K(0.0),{1},{2})",
}  # fmt: skip

LANES = Dialect(
    types={"real": "real"},
    constant=lambda value: Term(f"K({literal(value)})"),
    express=lambda code, operands: Term(TEXT[code].format(*(term.text for term in operands))),
)
