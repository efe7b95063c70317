"""The end cushion of a cylinder: a plunger that closes the port before the end, so that oil leaves through a gap."""

from __future__ import annotations

import casadi as ca

from ramsight.expression import Real


def cushion_force(left: Real, approach: Real, length: Real, area: Real, conductance: Real) -> Real:
    """Force that slows a piston down before its end [N], A (s A v/K)^2 with s = 1 - left/length.

    The way out narrows with the depth s of a tapered plunger, from an open port to the needle valve, with a conductance
    of K/s: the oil under it has the pressure (s Q/K)^2 above the chamber's. On the way back a check valve lets it in.

    Args:
        left: way that is left to the end [m].
        approach: velocity towards the end [m/s].
        length: of the cushion [m].
        area: of the piston around the plunger [m2].
        conductance: K at the end, Q/sqrt(dp) of the needle valve [m3/s/sqrt(Pa)].

    Source: the orifice equation; how the gap narrows is chosen so that the force sets in without a step. The oil's
    compression in the small volume under the plunger is left out.

    Example:
        >>> [round(float(cushion_force(left, 0.05, 0.02, 0.01, 1e-7)) / 1e3) for left in (0.02, 0.01, 0.0)]
        [0, 62, 250]
    """
    depth = ca.fmin(ca.fmax(1.0 - left / length, 0.0), 1.0)
    flow = depth * area * ca.fmax(approach, 0.0)
    return area * (flow / conductance) ** 2
